//! Does any prefix or change of a capture break the reader? Bytes may make it stop, never panic, hang
//! or lose what came before.

mod support;

use std::io::{self, Read};

use support::{Order, Outcome, PcapNg, frames, pcap, read};

const V4: [&str; 2] = ["192.168.1.201:2368", "192.168.1.100:2368"];
const V6: [&str; 2] = ["[fe80::1]:2368", "[fe80::2]:2368"];

/// Whole and fragmented datagrams of both IP versions, tagged and not.
fn all_frames() -> Vec<Vec<u8>> {
    let mut all = frames(V4[0], V4[1], b"first");
    all.extend(frames(V4[0], V4[1], &[1; 2000]));
    all.extend(frames(V6[0], V6[1], &[2; 1500]));
    let plain = frames(V6[0], V6[1], b"tagged").remove(0);
    all.push(
        [
            &plain[..12],
            &[0x88, 0xA8, 0, 1, 0x81, 0, 0, 2],
            &plain[12..],
        ]
        .concat(),
    );
    all.extend(frames(V4[0], V4[1], b"last"));
    all
}

/// The captures that are cut and changed: one of each format and byte order.
fn seeds() -> Vec<Vec<u8>> {
    let frames = all_frames();
    let mut seeds = vec![pcap(1, &frames)];
    for order in [Order::Little, Order::Big] {
        let mut file = PcapNg::new(order);
        file.interface(1, 0, &[(2, b"eth0"), (9, &[9])]);
        for (n, frame) in frames.iter().enumerate() {
            match n % 3 {
                0 => file.enhanced(0, n as u64, frame),
                1 => file.obsolete(0, n as u64, frame),
                _ => file.simple(frame.len() as u32, frame),
            }
        }
        file.block(5, &[0; 30]);
        file.section(Order::Little);
        file.interface(101, 0, &[]);
        file.enhanced(0, 9, &frames[0][14..]);
        seeds.push(file.bytes);
    }
    seeds
}

/// What holds for every outcome: datagrams and drops come from records.
fn check(outcome: &Outcome, len: usize) {
    assert!(outcome.records as usize <= len / 12);
    assert!(outcome.datagrams.len() as u64 <= outcome.records);
    let bytes: usize = outcome
        .datagrams
        .iter()
        .map(|(_, payload)| payload.len())
        .sum();
    assert!(bytes <= len, "{bytes} bytes of payload out of {len}");
}

#[test]
fn every_prefix_gives_the_records_that_are_whole() {
    for seed in seeds() {
        let whole = read(&seed[..]);
        assert_eq!((whole.error.clone(), whole.truncated_tail), (None, 0));
        assert!(whole.datagrams.len() >= 5);
        let mut before = 0;
        for len in 0..seed.len() {
            let outcome = read(&seed[..len]);
            check(&outcome, len);
            assert!(
                len < 24 || outcome.error.is_none(),
                "{len}: {:?}",
                outcome.error
            );
            assert_eq!(
                outcome.datagrams,
                whole.datagrams[..outcome.datagrams.len()],
                "{len}"
            );
            assert!(outcome.datagrams.len() >= before, "{len}");
            before = outcome.datagrams.len();
        }
    }
}

/// 100 000 captures with one to four changed bytes each, the same in every run.
#[test]
fn no_change_of_bytes_breaks_the_reader() {
    let seeds = seeds();
    let mut random = 0x9E37_79B9_7F4A_7C15u64;
    let mut next = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random as usize
    };
    let (mut errors, mut tails, mut bytes) = (0, 0, Vec::new());
    for round in 0..100_000 {
        bytes.clone_from(&seeds[round % seeds.len()]);
        for _ in 0..1 + next() % 4 {
            let at = next() % bytes.len();
            bytes[at] = match next() % 4 {
                0 => 0,
                1 => 0xFF,
                2 => bytes[at] ^ (1 << (next() % 8)),
                _ => next() as u8,
            };
        }
        let outcome = read(&bytes[..]);
        check(&outcome, bytes.len());
        errors += usize::from(outcome.error.is_some());
        tails += outcome.truncated_tail;
    }
    println!("{errors} ended in an error, {tails} in a truncated tail");
    // Lengths and magic numbers are hit now and then, payloads mostly.
    assert!((1_000..50_000).contains(&errors) && tails > 0);
}

/// Gives a few bytes at a time and is interrupted in between.
struct Dribble<'a>(&'a [u8], usize);

impl Read for Dribble<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.1 += 1;
        if self.1.is_multiple_of(3) {
            return Err(io::ErrorKind::Interrupted.into());
        }
        let count = self.0.len().min(into.len()).min(1 + self.1 % 7);
        into[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        Ok(count)
    }
}

#[test]
fn bytes_may_come_in_any_portions() {
    for seed in seeds() {
        assert_eq!(read(Dribble(&seed, 0)), read(&seed[..]));
    }
}

/// Fails after its bytes, as a disk or a decompressor does.
struct Breaking<'a>(&'a [u8], io::ErrorKind);

impl Read for Breaking<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self.0.read(into)? {
            0 => Err(self.1.into()),
            count => Ok(count),
        }
    }
}

#[test]
fn a_reader_that_breaks_loses_nothing_that_came_before() {
    let seed = pcap(1, &all_frames());
    let whole = read(&seed[..]);
    let outcome = read(Breaking(&seed, io::ErrorKind::Other));
    assert_eq!(outcome.datagrams, whole.datagrams);
    let error = outcome.error.unwrap().to_string();
    assert!(
        error.contains(&format!("byte {} of the capture", seed.len())),
        "{error}"
    );
    // A compressed stream that is cut short is no more than a truncated capture.
    let outcome = read(Breaking(
        &seed[..seed.len() - 1],
        io::ErrorKind::UnexpectedEof,
    ));
    assert_eq!((outcome.error, outcome.truncated_tail), (None, 1));
    assert_eq!(
        outcome.datagrams,
        whole.datagrams[..whole.datagrams.len() - 1]
    );
}
