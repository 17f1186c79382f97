//! Do independent programs see the same in a capture: pcap-parser for the files, etherparse for the
//! packets?

mod support;

use etherparse::defrag::IpDefragPool;
use etherparse::{NetSlice, SlicedPacket, TransportSlice, UdpHeader};
use lidar_deflect_core::capture::{PcapWriter, RecordReader};
use lidar_deflect_core::time::Timestamp;
use pcap_parser::{Block, PcapBlockOwned, PcapError, create_reader};

/// Time in nanoseconds and captured bytes.
type Row = (i64, Vec<u8>);

/// The records of a capture as pcap-parser reads them; stamps are taken as nanoseconds.
fn by_pcap_parser(bytes: &[u8]) -> Vec<Row> {
    let mut reader = create_reader(1 << 20, bytes).unwrap();
    let mut rows = Vec::new();
    let mut nanos_per_tick = 1;
    loop {
        match reader.next() {
            Ok((consumed, block)) => {
                rows.extend(row(&block, &mut nanos_per_tick));
                reader.consume(consumed);
            }
            Err(PcapError::Eof) => return rows,
            Err(PcapError::Incomplete(_)) => reader.refill().unwrap(),
            Err(error) => panic!("{error:?}"),
        }
    }
}

fn row(block: &PcapBlockOwned<'_>, nanos_per_tick: &mut i64) -> Option<Row> {
    match block {
        PcapBlockOwned::Legacy(record) => {
            let nanos = i64::from(record.ts_sec) * 1_000_000_000 + i64::from(record.ts_usec);
            Some((nanos, record.data.to_vec()))
        }
        PcapBlockOwned::NG(Block::InterfaceDescription(interface)) => {
            *nanos_per_tick = 1_000_000_000 / interface.ts_resolution().unwrap() as i64;
            None
        }
        PcapBlockOwned::NG(Block::EnhancedPacket(packet)) => {
            let ticks = i64::from(packet.ts_high) << 32 | i64::from(packet.ts_low);
            let data = &packet.data[..packet.caplen as usize];
            Some((ticks * *nanos_per_tick, data.to_vec()))
        }
        _ => None,
    }
}

fn by_ours(bytes: &[u8]) -> Vec<Row> {
    let mut reader = RecordReader::new(bytes).unwrap();
    let mut rows = Vec::new();
    while reader.advance().unwrap() {
        rows.push((reader.record().time.0, reader.record().data.to_vec()));
    }
    rows
}

/// Checks the headers of an unfragmented packet and returns its payload.
fn checked_payload(packet: &SlicedPacket<'_>) -> Vec<u8> {
    let Some(TransportSlice::Udp(udp)) = &packet.transport else {
        panic!("no UDP: {packet:?}");
    };
    let (header, payload) = (udp.to_header(), udp.payload().to_vec());
    let expected = match packet.net.as_ref().unwrap() {
        NetSlice::Ipv4(v4) => header.calc_checksum_ipv4(&v4.header().to_header(), &payload),
        NetSlice::Ipv6(v6) => header.calc_checksum_ipv6(&v6.header().to_header(), &payload),
        NetSlice::Arp(_) => panic!("ARP"),
    };
    assert_eq!(header.checksum, expected.unwrap());
    payload
}

/// Payloads of the frames as etherparse sees them, with checks of every checksum that it knows.
fn by_etherparse(frames: &[Row]) -> Vec<Vec<u8>> {
    let mut pool = IpDefragPool::<(), ()>::new();
    let mut payloads = Vec::new();
    for (_, frame) in frames {
        let packet = SlicedPacket::from_ethernet(frame).unwrap();
        if let Some(NetSlice::Ipv4(v4)) = &packet.net {
            let header = v4.header().to_header();
            assert_eq!(header.header_checksum, header.calc_header_checksum());
        }
        if !packet.is_ip_payload_fragmented() {
            payloads.push(checked_payload(&packet));
        } else if let Some(whole) = pool.process_sliced_packet(&packet, (), ()).unwrap() {
            let (header, payload) = UdpHeader::from_slice(&whole.payload).unwrap();
            assert_eq!(usize::from(header.length), whole.payload.len());
            payloads.push(payload.to_vec());
        }
    }
    payloads
}

#[test]
fn what_we_write_is_sound_to_others() {
    let mut writer = PcapWriter::new(Vec::new()).unwrap();
    let ends = [
        ["192.168.1.201:2368", "239.255.0.1:2368"],
        ["[fe80::201]:2368", "[ff02::1]:2369"],
    ];
    let mut expected = Vec::new();
    for (n, len) in [0, 1, 2, 1206, 1452, 1473, 8448, 24_896, 65_507]
        .into_iter()
        .enumerate()
    {
        for [source, destination] in ends {
            let payload: Vec<u8> = (0..len).map(|i| (i * 37 % 255) as u8).collect();
            let time = Timestamp(1_700_000_000_000_000_001 + n as i64);
            let (source, destination) = (source.parse().unwrap(), destination.parse().unwrap());
            writer
                .write_udp(time, source, destination, &payload)
                .unwrap();
            expected.push(payload);
        }
    }
    let file = writer.into_inner();
    let rows = by_pcap_parser(&file);
    assert!(rows == by_ours(&file));
    assert!(rows.iter().all(|(_, frame)| frame.len() <= 14 + 1500));
    assert!(by_etherparse(&rows) == expected);
}

/// A recording of Wireshark on macOS, with its name tables and comments.
#[test]
fn a_real_pcapng_is_read_alike() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/captures/hesai_pandar40p_1200rpm.pcapng"
    );
    let Ok(bytes) = std::fs::read(path) else {
        return println!("skipped: the shared captures are not beside this project");
    };
    let rows = by_pcap_parser(&bytes);
    assert_eq!(rows.len(), 200);
    assert!(rows == by_ours(&bytes));
}

#[test]
fn pcapng_of_both_orders_is_read_alike() {
    for order in [support::Order::Little, support::Order::Big] {
        let mut file = support::PcapNg::new(order);
        file.interface(1, 0, &[(2, b"eth0"), (9, &[9])]);
        for n in 0..100 {
            file.enhanced(0, 1_700_000_000_000_000_000 + n, &support::frame(&[7; 33]));
            file.block(5, &[0; 12]);
        }
        assert!(by_pcap_parser(&file.bytes) == by_ours(&file.bytes));
    }
}
