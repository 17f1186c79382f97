//! The list of all models, and how one is found by its name or by what it is sent.

use super::strangers::stranger;
use super::unit::UnitFile;
use super::{
    Misfit, ModelRef, PacketKind, hesai, leishen, livox, ouster, points, robosense, velodyne,
};
use crate::error::InvalidValue;

/// All sensor models, the likelier one first where content and timing fit several.
pub static MODELS: &[ModelRef] = &[
    &velodyne::puck::VLP16,
    &velodyne::puck::VLP16_HIRES,
    &velodyne::puck::PUCK_LITE,
    &velodyne::hdl32e::HDL32E,
    &velodyne::vlp32::VLP32C,
    &velodyne::vlp32::VLP32A,
    &velodyne::vls128::VLS128,
    &velodyne::hdl64e::HDL64E_S3,
    &velodyne::hdl64e::HDL64E_S2,
    &hesai::pandar::PANDAR40P,
    &hesai::pandar::PANDAR40AC,
    &hesai::pandar::PANDAR64,
    &hesai::xt::XT16,
    &hesai::xt::XT32,
    &hesai::xt::XT32M2X,
    &hesai::xt::QT64,
    &hesai::qt128::QT128,
    &hesai::pandar128::PANDAR128,
    &hesai::pandar128::PANDAR90,
    &hesai::pandar128::OT128,
    &hesai::pandar128::JT128,
    &hesai::at128::AT128,
    &hesai::atx::ATX,
    &hesai::ft120::FT120,
    &hesai::jt16::JT16,
    &ouster::bare::OUSTER,
    &ouster::bare::OS0,
    &ouster::bare::OS1,
    &ouster::bare::OS2,
    &ouster::bare::OSDOME,
    &ouster::bare::PRODUCTS[0],
    &ouster::bare::PRODUCTS[1],
    &ouster::bare::PRODUCTS[2],
    &ouster::bare::PRODUCTS[3],
    &ouster::bare::PRODUCTS[4],
    &ouster::bare::PRODUCTS[5],
    &ouster::bare::PRODUCTS[6],
    &ouster::bare::PRODUCTS[7],
    &ouster::bare::PRODUCTS[8],
    &ouster::bare::PRODUCTS[9],
    &ouster::bare::PRODUCTS[10],
    &ouster::bare::PRODUCTS[11],
    &ouster::bare::PRODUCTS[12],
    &robosense::helios::HELIOS_16P,
    &robosense::helios::HELIOS_32,
    &robosense::helios::HELIOS_32_31DEG,
    &robosense::helios::HELIOS_32_26DEG,
    &robosense::rs::RS_16,
    &robosense::rs::RS_32,
    &robosense::bpearl::BPEARL,
    &robosense::bpearl::BPEARL_4,
    &robosense::ruby::RUBY_128,
    &robosense::ruby::RUBY_80,
    &robosense::ruby::RUBY_48,
    &robosense::ruby::PLUS_128,
    &robosense::ruby::PLUS_80,
    &robosense::ruby::PLUS_48,
    &robosense::airy::AIRY,
    &robosense::airy::FAIRY,
    &leishen::products::MODELS[0],
    &leishen::products::MODELS[1],
    &leishen::products::MODELS[2],
    &leishen::products::MODELS[3],
    &leishen::products::MODELS[4],
    &leishen::products::MODELS[5],
    &leishen::products::MODELS[6],
    &leishen::products::MODELS[7],
    &leishen::products::MODELS[8],
    &leishen::products::MODELS[9],
    &leishen::products::MODELS[10],
    &leishen::products::MODELS[11],
    &leishen::products::MODELS[12],
    &leishen::products::MODELS[13],
    &leishen::products::MODELS[14],
    &leishen::products::MODELS[15],
    &leishen::products::MODELS[16],
    &leishen::products::MODELS[17],
    &leishen::products::MODELS[18],
    &leishen::products::MODELS[19],
    &leishen::mirror::MODELS[0],
    &leishen::mirror::MODELS[1],
    &leishen::mirror::MODELS[2],
    &leishen::mirror::MODELS[3],
    &leishen::mirror::MODELS[4],
    &leishen::mirror::MODELS[5],
    &leishen::mirror::MODELS[6],
    &leishen::mirror::MODELS[7],
    &robosense::solid::sensor::M1,
    &robosense::solid::sensor::M1_PLUS,
    &robosense::solid::sensor::M1_JUMBO,
    &robosense::solid::sensor::M2,
    &robosense::solid::sensor::M3,
    &robosense::solid::sensor::MX,
    &robosense::solid::sensor::E1,
    &robosense::solid::sensor::EMX,
    &robosense::solid::sensor::EM4,
    &livox::sensor::MID_40,
    &livox::sensor::MID_70,
    &livox::sensor::AVIA,
    &livox::sensor::HORIZON,
    &livox::sensor::TELE_15,
    &livox::sensor::MID_360,
    &livox::sensor::HAP,
    &points::POINTS,
];

/// Other names of models, in the spelling of [`squeezed`].
const ALIASES: &[(&str, &str)] = &[
    ("pandar128e3x", "pandar128"),
    ("pandar90e3x", "pandar90"),
    ("pandar40m", "pandar40p"),
    ("pandarqt64", "qt64"),
    ("pandarqt", "qt64"),
    ("pandarqt128", "qt128"),
    ("pandarxt16", "xt16"),
    ("pandarxt32", "xt32"),
    ("xt32m", "xt32m2x"),
    ("pandarat128", "at128"),
    ("hdl64es3", "hdl64e"),
    ("hdl64", "hdl64e"),
    ("hdl32", "hdl32e"),
    ("vlp16lite", "puck-lite"),
    ("puckhires", "vlp16-hires"),
    ("alphaprime", "vls128"),
    ("helios5515", "helios32"),
    ("helios1615", "helios32-31deg"),
    ("rslidar16", "rs16"),
    ("rslidar32", "rs32"),
    ("rsbpearl", "bpearl"),
    ("rshelios16p", "helios16p"),
    ("rshelios", "helios32"),
    ("rubylite", "ruby-80"),
    ("rubyrs128", "ruby-128"),
    ("rubyrs80", "ruby-80"),
    ("rubyrs48", "ruby-48"),
    ("rubyplusp128", "ruby-plus-128"),
    ("rubyplusp80", "ruby-plus-80"),
    ("rubyplusp48", "ruby-plus-48"),
    ("pandar128e4x", "ot128"),
    ("ft120c1x", "ft120"),
    ("qt128c2x", "qt128"),
    ("at128e2x", "at128"),
];

/// Makers whose name may stand before that of the product, in the spelling of [`squeezed`].
const MAKERS: &[&str] = &[
    "velodyne",
    "hesai",
    "robosense",
    "rs",
    "ouster",
    "livox",
    "leishen",
    "lslidar",
];

/// A name without the dashes, spaces and capitals in which spellings differ.
fn squeezed(name: &str) -> String {
    let kept = name.chars().filter(char::is_ascii_alphanumeric);
    kept.map(|c| c.to_ascii_lowercase()).collect()
}

/// The model with this id; dashes and capitals do not matter, and older names are taken as well.
///
/// # Errors
/// [`InvalidValue`] that lists the known ids.
pub fn model(id: &str) -> Result<ModelRef, InvalidValue> {
    let name = squeezed(id);
    let without = MAKERS.iter().filter_map(|maker| name.strip_prefix(maker));
    let known = std::iter::once(name.as_str())
        .chain(without)
        .find_map(named);
    known.ok_or_else(|| InvalidValue {
        name: "sensor model",
        expected: MODELS.iter().map(|m| m.id()).collect::<Vec<_>>().join(", "),
        found: id.into(),
    })
}

/// The model with this id or older name, in the spelling of [`squeezed`].
fn named(name: &str) -> Option<ModelRef> {
    let alias = ALIASES.iter().find(|(other, _)| *other == name);
    let name = alias.map_or_else(|| name.to_owned(), |(_, id)| squeezed(id));
    let known = MODELS.iter().find(|model| squeezed(model.id()) == name);
    known.copied()
}

/// Models that claim `payload` as their data packet, the likelier one first.
pub fn claimants(payload: &[u8]) -> impl Iterator<Item = ModelRef> + '_ {
    let claims = |model: &ModelRef| model.recognise(payload) == Some(PacketKind::Data);
    MODELS.iter().copied().filter(claims)
}

/// Models of the single units that `files` describe.
pub fn unit_models(files: &[UnitFile]) -> Vec<ModelRef> {
    MODELS.iter().flat_map(|model| model.units(files)).collect()
}

/// What `payload` is beside data and whose, if any model knows.
pub fn companion(payload: &[u8]) -> Option<(ModelRef, PacketKind)> {
    let known = |model: &ModelRef| Some((*model, model.recognise(payload)?));
    let mut kinds = MODELS.iter().filter_map(known);
    kinds.find(|(_, kind)| *kind != PacketKind::Data)
}

/// What a packet that nobody claims is, as far as its format is known, else how close it comes to a model.
pub fn closest(payload: &[u8]) -> Option<Misfit> {
    if let Some(misfit) = stranger(payload) {
        return Some(misfit);
    }
    let model = MODELS.iter().find(|model| model.fits(payload))?;
    Some(model.misfit(payload))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_candidates_exist() {
        for (place, one) in MODELS.iter().enumerate() {
            assert!(MODELS[..place].iter().all(|other| other.id() != one.id()));
            assert!(one.candidates().iter().all(|id| model(id).is_ok()));
        }
        assert!(model("vlp61").unwrap_err().expected.contains("vlp16"));
    }

    #[test]
    fn spellings_and_older_names_are_taken_and_never_clash() {
        for (place, one) in MODELS.iter().enumerate() {
            let is_same = |other: &&ModelRef| squeezed(other.id()) == squeezed(one.id());
            assert_eq!(MODELS[..place].iter().find(is_same).map(|m| m.id()), None);
            assert_eq!(model(&one.id().to_uppercase()).unwrap().id(), one.id());
        }
        for (alias, id) in ALIASES {
            assert!(MODELS.iter().all(|model| squeezed(model.id()) != *alias));
            assert_eq!(model(alias).unwrap().id(), *id);
        }
        assert_eq!(model("helios-16p").unwrap().id(), "helios16p");
        assert_eq!(model("RS-16").unwrap().id(), "rs16");
        assert_eq!(model("rs-m1").unwrap().id(), "m1");
        assert_eq!(model("Hesai PandarXT-32").unwrap().id(), "xt32");
        assert_eq!(
            model("robosense_ruby_plus_p128").unwrap().id(),
            "ruby-plus-128"
        );
        assert!(model("rs-m9").is_err());
    }
}
