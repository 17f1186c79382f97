//! A whole capture: pcap or pcapng, any link layer, fragments.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lidar_deflect_core::capture::DatagramReader;
use lidar_deflect_core::stream::{Scan, ScanOptions};

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut reader) = DatagramReader::new(bytes) else {
        return;
    };
    let mut scan = Scan::new(ScanOptions::default());
    while let Ok(Some(datagram)) = reader.next() {
        scan.push(&datagram);
    }
    let report = scan.finish();
    assert!(report.datagrams as usize <= bytes.len());
});
