//! A file that describes a unit: angles, metadata, packets.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lidar_deflect_core::packet::MODELS;
use lidar_deflect_core::packet::unit::UnitFile;

fuzz_target!(|bytes: &[u8]| {
    let files = [UnitFile::new("fuzz", bytes)];
    for model in MODELS {
        if model.takes(&files[0]) {
            let _ = (model.describe(&files), model.fit(&files).is_ok());
        }
    }
});
