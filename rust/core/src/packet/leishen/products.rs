//! The models of the C series: product bytes, angles and where their lenses stand.
//!
//! Source: the maker's driver.

use super::cx::{Cx, Generation};

/// What one model is.
#[derive(Debug, PartialEq)]
pub struct Product {
    /// Id of the model.
    pub id: &'static str,
    /// Name with vendor.
    pub title: &'static str,
    /// Byte that tells it.
    pub code: u8,
    /// Layout of its packets.
    pub generation: Generation,
    /// Elevations by channel, degrees.
    pub elevation_deg: &'static [f64],
    /// Metres of one unit of range.
    pub unit_m: f64,
    /// Distance of the lens from the axis, metres, and its angle behind the beam, degrees.
    pub lens: (f64, f64),
    /// Shots a second, as sold; where packets come at another pace theirs is taken.
    pub shots_per_s: f64,
}

const C16_DEG: &[f64] = &[
    -16.0, 0.0, -14.0, 2.0, -12.0, 4.0, -10.0, 6.0, -8.0, 8.0, -6.0, 10.0, -4.0, 12.0, -2.0, 14.0,
];
const C16_V3_DEG: &[f64] = &[
    -15.0, 1.0, -13.0, 3.0, -11.0, 5.0, -9.0, 7.0, -7.0, 9.0, -5.0, 11.0, -3.0, 13.0, -1.0, 15.0,
];
const C16_V5_DEG: &[f64] = &[
    -16.0, 0.0, -8.0, 8.0, -14.0, 2.0, -6.0, 10.0, -12.0, 4.0, -4.0, 12.0, -10.0, 6.0, -2.0, 14.0,
];
const C32_DEG: &[f64] = &[
    -16.0, -8.0, 0.0, 8.0, -15.0, -7.0, 1.0, 9.0, -14.0, -6.0, 2.0, 10.0, -13.0, -5.0, 3.0, 11.0,
    -12.0, -4.0, 4.0, 12.0, -11.0, -3.0, 5.0, 13.0, -10.0, -2.0, 6.0, 14.0, -9.0, -1.0, 7.0, 15.0,
];
const C32_V3_DEG: &[f64] = &[
    -16.0, 0.0, -15.0, 1.0, -14.0, 2.0, -13.0, 3.0, -12.0, 4.0, -11.0, 5.0, -10.0, 6.0, -9.0, 7.0,
    -8.0, 8.0, -7.0, 9.0, -6.0, 10.0, -5.0, 11.0, -4.0, 12.0, -3.0, 13.0, -2.0, 14.0, -1.0, 15.0,
];
const C32_V5_DEG: &[f64] = &[
    -20.8, 0.0, -10.4, 10.4, -15.6, 5.2, -5.2, 15.6, -19.5, 1.3, -9.1, 11.7, -14.3, 6.5, -3.9,
    16.9, -18.2, 2.6, -7.8, 13.0, -13.0, 7.8, -2.6, 18.2, -16.9, 3.9, -6.5, 14.3, -11.7, 9.1, -1.3,
    19.5,
];
const C32WP_DEG: &[f64] = &[
    -51.0, -31.0, -9.0, 3.0, -48.5, -28.0, -7.5, 4.5, -46.0, -25.0, -6.0, 6.0, -43.5, -22.0, -4.5,
    7.5, -41.0, -18.5, -3.0, 9.0, -38.5, -15.0, -1.5, 11.0, -36.0, -12.0, 0.0, 13.0, -33.5, -10.5,
    1.5, 15.0,
];
const C32W_DEG: &[f64] = &[
    -54.0, -31.0, -8.0, 2.66, -51.5, -28.0, -6.66, 4.0, -49.0, -25.0, -5.33, 5.5, -46.0, -22.0,
    -4.0, 7.0, -43.0, -18.5, -2.66, 9.0, -40.0, -15.0, -1.33, 11.0, -37.0, -12.0, 0.0, 13.0, -34.0,
    -10.0, 1.33, 15.0,
];
const C32WN_DEG: &[f64] = &[
    -54.7, -31.0, -9.0, 3.0, -51.5, -28.0, -7.5, 4.5, -49.0, -25.0, -6.0, 6.0, -46.0, -22.0, -4.5,
    7.5, -43.0, -18.5, -3.0, 9.0, -40.0, -15.0, -1.5, 11.0, -37.0, -12.0, 0.0, 13.0, -34.0, -10.5,
    1.5, 15.0,
];
const C32WB_DEG: &[f64] = &[
    -54.7, -9.0, -31.0, 3.0, -51.5, -7.5, -28.0, 4.5, -49.0, -6.0, -25.0, 6.0, -46.0, -4.5, -22.0,
    7.5, -43.0, -3.0, -18.5, 9.0, -40.0, -1.5, -15.0, 11.0, -37.0, 0.0, -12.0, 13.0, -34.0, 1.5,
    -10.5, 15.0,
];
const CH32R_DEG: &[f64] = &[
    2.487, 25.174, 47.201, 68.819, 5.596, 27.811, 49.999, 71.525, 8.591, 30.429, 52.798, 74.274,
    11.494, 33.191, 55.596, 77.074, 14.324, 36.008, 58.26, 79.938, 17.096, 38.808, 60.87, 82.884,
    19.824, 41.603, 63.498, 85.933, 22.513, 44.404, 66.144, 89.105,
];
const CH32RN_DEG: &[f64] = &[
    2.487, 47.201, 25.174, 68.819, 5.596, 49.999, 27.811, 71.525, 8.591, 52.798, 30.429, 74.274,
    11.494, 55.596, 33.191, 77.074, 14.324, 58.26, 36.008, 79.938, 17.096, 60.87, 38.808, 82.884,
    19.824, 63.498, 41.603, 85.933, 22.513, 66.144, 44.404, 89.105,
];
const C8_DEG: &[f64] = &[-10.0, 4.0, -8.0, 8.0, -4.0, 10.0, 0.0, 12.0];
const C8F_DEG: &[f64] = &[-2.0, 6.0, 0.0, 8.0, 2.0, 10.0, 4.0, 12.0];
const CKM8_DEG: &[f64] = &[-12.0, 4.0, -8.0, 8.0, -4.0, 10.0, 0.0, 12.0];
const C1_DEG: &[f64] = &[0.0];

/// All models of the series.
pub static PRODUCTS: [Product; 20] = [
    Product {
        id: "c16",
        title: "Leishen C16",
        code: 0x10,
        generation: Generation::Fourth,
        elevation_deg: C16_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 320_000.0,
    },
    Product {
        id: "c32",
        title: "Leishen C32",
        code: 0x20,
        generation: Generation::Fourth,
        elevation_deg: C32_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "c16-v3",
        title: "Leishen C16 (version 3)",
        code: 0x10,
        generation: Generation::Third,
        elevation_deg: C16_V3_DEG,
        unit_m: 0.0025,
        lens: (0.0431, 14.68),
        shots_per_s: 320_000.0,
    },
    Product {
        id: "c32-v3",
        title: "Leishen C32 (version 3)",
        code: 0x20,
        generation: Generation::Third,
        elevation_deg: C32_V3_DEG,
        unit_m: 0.0025,
        lens: (0.0494, 12.98),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "c16-v5",
        title: "Leishen C16 (version 5)",
        code: 0x65,
        generation: Generation::Fourth,
        elevation_deg: C16_V5_DEG,
        unit_m: 0.004,
        lens: (0.035, 21.8),
        shots_per_s: 320_000.0,
    },
    Product {
        id: "c32-v5",
        title: "Leishen C32 (version 5)",
        code: 0x64,
        generation: Generation::Fourth,
        elevation_deg: C32_V5_DEG,
        unit_m: 0.004,
        lens: (0.035, 21.8),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "msc16",
        title: "Leishen MSC16",
        code: 0x11,
        generation: Generation::Fourth,
        elevation_deg: C16_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 320_000.0,
    },
    Product {
        id: "c16-domestic",
        title: "Leishen C16 (domestic)",
        code: 0x12,
        generation: Generation::Fourth,
        elevation_deg: C16_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 320_000.0,
    },
    Product {
        id: "c32wp",
        title: "Leishen C32WP",
        code: 0x45,
        generation: Generation::Fourth,
        elevation_deg: C32WP_DEG,
        unit_m: 0.004,
        lens: (0.034_16, 20.25),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "c32w",
        title: "Leishen C32W",
        code: 0x46,
        generation: Generation::Fourth,
        elevation_deg: C32W_DEG,
        unit_m: 0.004,
        lens: (0.034_16, 20.25),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "c32wn",
        title: "Leishen C32WN",
        code: 0x47,
        generation: Generation::Fourth,
        elevation_deg: C32WN_DEG,
        unit_m: 0.004,
        lens: (0.034_16, 20.25),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "c32wb",
        title: "Leishen C32WB",
        code: 0x48,
        generation: Generation::Fourth,
        elevation_deg: C32WB_DEG,
        unit_m: 0.004,
        lens: (0.034_16, 20.25),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "ch32r",
        title: "Leishen CH32R",
        code: 0x5A,
        generation: Generation::Fourth,
        elevation_deg: CH32R_DEG,
        unit_m: 0.004,
        lens: (0.0209, 27.76),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "ch32rn",
        title: "Leishen CH32RN",
        code: 0x5D,
        generation: Generation::Fourth,
        elevation_deg: CH32RN_DEG,
        unit_m: 0.004,
        lens: (0.0209, 27.76),
        shots_per_s: 640_000.0,
    },
    Product {
        id: "c8",
        title: "Leishen C8",
        code: 0x08,
        generation: Generation::Fourth,
        elevation_deg: C8_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 160_000.0,
    },
    Product {
        id: "c8f",
        title: "Leishen C8F",
        code: 0x07,
        generation: Generation::Fourth,
        elevation_deg: C8F_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 160_000.0,
    },
    Product {
        id: "ckm8",
        title: "Leishen CKM8 or C4",
        code: 0x09,
        generation: Generation::Fourth,
        elevation_deg: CKM8_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 160_000.0,
    },
    Product {
        id: "c1",
        title: "Leishen C1",
        code: 0x01,
        generation: Generation::Fourth,
        elevation_deg: C1_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 20_000.0,
    },
    Product {
        id: "c1-plus",
        title: "Leishen C1 Plus",
        code: 0x03,
        generation: Generation::Fourth,
        elevation_deg: C1_DEG,
        unit_m: 0.004,
        lens: (0.0361, 20.25),
        shots_per_s: 20_000.0,
    },
    Product {
        id: "n301",
        title: "Leishen N301",
        code: 0x06,
        generation: Generation::Fourth,
        elevation_deg: C1_DEG,
        unit_m: 0.001,
        lens: (0.0361, 20.25),
        shots_per_s: 20_000.0,
    },
];

/// The models, in the order of [`PRODUCTS`].
pub static MODELS: [Cx; 20] = [
    Cx::of(&PRODUCTS[0]),
    Cx::of(&PRODUCTS[1]),
    Cx::of(&PRODUCTS[2]),
    Cx::of(&PRODUCTS[3]),
    Cx::of(&PRODUCTS[4]),
    Cx::of(&PRODUCTS[5]),
    Cx::of(&PRODUCTS[6]),
    Cx::of(&PRODUCTS[7]),
    Cx::of(&PRODUCTS[8]),
    Cx::of(&PRODUCTS[9]),
    Cx::of(&PRODUCTS[10]),
    Cx::of(&PRODUCTS[11]),
    Cx::of(&PRODUCTS[12]),
    Cx::of(&PRODUCTS[13]),
    Cx::of(&PRODUCTS[14]),
    Cx::of(&PRODUCTS[15]),
    Cx::of(&PRODUCTS[16]),
    Cx::of(&PRODUCTS[17]),
    Cx::of(&PRODUCTS[18]),
    Cx::of(&PRODUCTS[19]),
];
