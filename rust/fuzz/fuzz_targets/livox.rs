//! A data packet of any Livox model.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| lidar_deflect_fuzz::family("Livox", bytes));
