//! Are pcapng files of any make, and frames of any link layer, read as they are meant?

mod support;

use lidar_deflect_core::capture::{DatagramReader, RecordReader};
use lidar_deflect_core::error::CaptureError;
use support::{Order, PcapNg, frame, frames, pcap, read};

const MICROS: u64 = 1_700_000_000_123_456;

fn payloads(bytes: &[u8]) -> Vec<(i64, Vec<u8>)> {
    let outcome = read(bytes);
    assert_eq!(outcome.error, None);
    outcome.datagrams
}

#[test]
fn sections_have_their_own_order_and_interfaces() {
    for (first, second) in [(Order::Little, Order::Big), (Order::Big, Order::Little)] {
        let mut file = PcapNg::new(first);
        file.interface(1, 0, &[]);
        file.interface(101, 0, &[(2, b"wifi0"), (9, &[9])]);
        file.enhanced(0, MICROS, &frame(b"one"));
        file.enhanced(1, MICROS * 1000 + 7, &frame(b"two")[14..]);
        file.section(second);
        file.interface(1, 0, &[(9, &[0x80 | 10])]);
        file.enhanced(0, 3 << 9, &frame(b"three")); // 1.5 s in units of 2^-10 s
        let expected = [
            (MICROS as i64 * 1000, b"one".to_vec()),
            (MICROS as i64 * 1000 + 7, b"two".to_vec()),
            (1_500_000_000, b"three".to_vec()),
        ];
        assert_eq!(payloads(&file.bytes), expected);
    }
}

#[test]
fn offsets_of_interfaces_are_added() {
    for order in [Order::Little, Order::Big] {
        let mut file = PcapNg::new(order);
        let offset = match order {
            Order::Little => 1_700_000_000i64.to_le_bytes(),
            Order::Big => 1_700_000_000i64.to_be_bytes(),
        };
        file.interface(1, 0, &[(9, &[3]), (14, &offset)]);
        file.enhanced(0, 5, &frame(b"x"));
        assert_eq!(payloads(&file.bytes)[0].0, 1_700_000_000_005_000_000);
    }
}

#[test]
fn obsolete_and_simple_packets() {
    let mut file = PcapNg::new(Order::Big);
    file.interface(1, 0, &[]);
    file.simple(frame(b"before").len() as u32, &frame(b"before"));
    file.obsolete(0, MICROS, &frame(b"old"));
    file.simple(frame(b"simple").len() as u32, &frame(b"simple"));
    let time = MICROS as i64 * 1000;
    // Without a stamp that of the record before counts, and 1970 where there is none.
    let expected = [
        (0, b"before".to_vec()),
        (time, b"old".to_vec()),
        (time, b"simple".to_vec()),
    ];
    assert_eq!(payloads(&file.bytes), expected);
    let mut reader = DatagramReader::new(&file.bytes[..]).unwrap();
    while reader.next().unwrap().is_some() {}
    assert_eq!(
        (reader.facts().without_time, reader.facts().records),
        (2, 3)
    );
}

#[test]
fn simple_packets_are_cut_by_the_interface() {
    let whole = frame(b"0123456789");
    let mut file = PcapNg::new(Order::Little);
    file.interface(1, 40, &[]);
    file.simple(whole.len() as u32, &whole[..40]);
    let outcome = read(&file.bytes[..]);
    assert_eq!(outcome.drops.count("truncated_record"), 1);
    assert_eq!((outcome.records, outcome.datagrams.len()), (1, 0));
}

#[test]
fn blocks_of_other_kinds_are_skipped() {
    let mut file = PcapNg::new(Order::Little);
    file.interface(1, 0, &[]);
    for kind in [4, 5, 9, 10, 0xBAD, 0x4000_0BAD, 0x8000_0001, 0x7777] {
        file.block(kind, &vec![0xAA; 3_000_000]);
        file.enhanced(0, u64::from(kind), &frame(b"x"));
    }
    assert_eq!(payloads(&file.bytes).len(), 8);
}

#[test]
fn packets_that_make_no_sense_are_counted_and_the_file_goes_on() {
    let mut file = PcapNg::new(Order::Little);
    file.simple(4, &[0; 4]); // before any interface
    file.interface(1, 0, &[]);
    file.enhanced(7, 0, &frame(b"x")); // of no interface
    file.block(6, &[0; 16]); // shorter than its own head
    let mut body = vec![0; 20];
    body[12] = 200; // claims 200 captured bytes
    file.block(6, &body);
    file.enhanced(0, 0, &frame(b"good"));
    let outcome = read(&file.bytes[..]);
    assert_eq!(outcome.datagrams, [(0, b"good".to_vec())]);
    assert_eq!(outcome.drops.count("unknown_interface"), 2);
    assert_eq!(outcome.drops.count("damaged_block"), 2);
    assert_eq!(outcome.records, 5);
}

#[test]
fn garbage_in_pcapng_names_its_place_and_spares_what_came_before() {
    let good = {
        let mut file = PcapNg::new(Order::Little);
        file.interface(1, 0, &[]);
        file.enhanced(0, 0, &frame(b"good"));
        file
    };
    let place = good.bytes.len() as u64;
    let foot_wrong = {
        let mut file = PcapNg::new(Order::Little);
        file.interface(1, 0, &[]);
        file.enhanced(0, 0, &frame(b"bad"));
        let block = file.bytes[48..].to_vec();
        let last = block.len() - 4;
        [&block[..last], &[1, 0, 0, 0]].concat()
    };
    let section = b"\x0A\x0D\x0D\x0A\x1C\0\0\0BOM?\x01\0\0\0\0\0\0\0\0\0\0\0\x1C\0\0\0".to_vec();
    for (garbage, expected) in [
        (vec![0; 12], "a block length between 12 and"),
        (vec![0xFF; 12], "a block length between 12 and"),
        (vec![6, 0, 0, 0, 13, 0, 0, 0, 0, 0, 0, 0], "a multiple of 4"),
        (foot_wrong, "again behind the block"),
        (section, "byte-order magic"),
    ] {
        let bytes = [&good.bytes[..], &garbage, &good.bytes[28..]].concat();
        let outcome = read(&bytes[..]);
        assert_eq!(outcome.datagrams.len(), 1);
        match outcome.error {
            Some(CaptureError::Damaged {
                record: 1,
                offset,
                expected: text,
                ..
            }) => {
                assert_eq!(offset, place);
                assert!(text.contains(expected), "{text}");
            }
            other => panic!("{expected}: {other:?}"),
        }
    }
}

#[test]
fn an_unknown_version_of_pcapng_is_refused() {
    let mut file = PcapNg::new(Order::Big);
    file.bytes[13] = 2;
    let error = read(&file.bytes[..]).error.unwrap();
    assert!(
        matches!(error, CaptureError::Version { offset: 12, .. }),
        "{error}"
    );
}

/// The same datagram below every link layer.
#[test]
fn link_layers_lead_to_the_same_datagram() {
    for version in 0..2 {
        let (ethernet, ether_type, family) = match version {
            0 => (frame(b"payload"), [0x08, 0x00], 2u32),
            _ => (
                frames("[fe80::1]:1", "[ff02::2]:2", b"payload").remove(0),
                [0x86, 0xDD],
                30,
            ),
        };
        let ip = ethernet[14..].to_vec();
        let tags = |tags: &[u8]| [&ethernet[..12], tags, &ether_type, &ip].concat();
        let behind = |head: &[u8]| [head, &ip].concat();
        let sll = [&[0; 14], &ether_type[..]].concat();
        let sll2 = [&ether_type[..], &[0; 18]].concat();
        let raw_by_version = [228, 229][version];
        let cases = [
            (1, ethernet.clone()),
            (1, tags(&[0x81, 0x00, 0x00, 0x05])),
            (1, tags(&[0x88, 0xA8, 0x00, 0x05, 0x81, 0x00, 0x00, 0x06])),
            (1, tags(&[0x91, 0x00, 0x00, 0x05, 0x92, 0x00, 0x00, 0x06])),
            (113, behind(&sll)),
            (276, behind(&sll2)),
            (0, behind(&family.to_le_bytes())),
            (0, behind(&family.to_be_bytes())),
            (108, behind(&family.to_be_bytes())),
            (101, ip.clone()),
            (12, ip.clone()),
            (14, ip.clone()),
            (raw_by_version, ip.clone()),
        ];
        for (linktype, data) in cases {
            let outcome = read(&pcap(linktype, &[data])[..]);
            assert_eq!(
                outcome.datagrams,
                [(0, b"payload".to_vec())],
                "link type {linktype}"
            );
            assert_eq!(outcome.drops.iter().count(), 0);
        }
    }
}

#[test]
fn every_drop_has_its_reason() {
    let good = frame(b"payload");
    let changed = |at: usize, byte: u8| {
        let mut frame = good.clone();
        frame[at] = byte;
        frame
    };
    // IPv4 alone may say too much, as the first VLP-16 did; that both do is a cut.
    let mut cut = changed(14 + 3, 200);
    cut[14 + 20 + 5] = 200;
    let cases = [
        ("not_ip", changed(13, 0x06)),
        ("not_udp", changed(14 + 9, 6)),
        ("damaged_headers", changed(14, 0x65)),
        ("truncated_record", cut),
        ("truncated_record", changed(14 + 20 + 5, 200)),
        ("damaged_headers", good[..20].to_vec()),
        ("damaged_headers", Vec::new()),
    ];
    for (reason, frame) in cases {
        let outcome = read(&pcap(1, &[good.clone(), frame])[..]);
        assert_eq!(outcome.drops.iter().collect::<Vec<_>>(), [(reason, 1)]);
        assert_eq!(outcome.datagrams.len(), 1, "{reason}");
    }
    let outcome = read(&pcap(147, std::slice::from_ref(&good))[..]);
    assert_eq!(outcome.drops.count("unknown_linktype"), 1);
}

#[test]
fn a_record_that_the_snap_length_cut_is_counted_and_left_out() {
    let mut bytes = pcap(1, &[frame(b"payload"), frame(b"whole")]);
    bytes[24 + 12] += 1; // one byte more on the wire than in the file
    let outcome = read(&bytes[..]);
    assert_eq!(
        outcome.drops.iter().collect::<Vec<_>>(),
        [("truncated_record", 1)]
    );
    assert_eq!(outcome.datagrams, [(1_000_000_000, b"whole".to_vec())]);
}

/// Vendor tools store datagrams that are put together already: far longer than an Ethernet frame.
#[test]
fn frames_longer_than_ethernet_are_read() {
    let whole: Vec<u8> = (0..24_896).map(|i| (i % 251) as u8).collect();
    let mut long = frame(b"");
    let (ip_len, udp_len) = ((28 + whole.len()) as u16, (8 + whole.len()) as u16);
    long[16..18].copy_from_slice(&ip_len.to_be_bytes());
    long[38..40].copy_from_slice(&udp_len.to_be_bytes());
    long.extend(&whole);
    assert_eq!(payloads(&pcap(1, &[long.clone()])), [(0, whole.clone())]);
    // Captured before the network card cut it: total length 0.
    long[16..18].copy_from_slice(&[0, 0]);
    assert_eq!(payloads(&pcap(1, &[long])), [(0, whole)]);
}

#[test]
fn records_tell_their_number_and_place() {
    let bytes = pcap(1, &[frame(b"a"), frame(b"bc")]);
    let mut reader = RecordReader::new(&bytes[..]).unwrap();
    let mut places = Vec::new();
    while reader.advance().unwrap() {
        places.push((reader.record().number, reader.record().offset));
    }
    assert_eq!(places, [(0, 24), (1, 24 + 16 + 43)]);
    assert_eq!(reader.facts().linktypes.get(&1), Some(&2));
}
