//! A data packet of any Hesai model.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| lidar_deflect_fuzz::family("Hesai", bytes));
