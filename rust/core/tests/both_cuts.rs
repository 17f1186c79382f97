//! Does one reading for two cuts give the sweeps of two readings?

#[path = "support/puck.rs"]
mod puck;

use lidar_deflect_core::angle::Arc;
use lidar_deflect_core::capture::DatagramBatch;
use lidar_deflect_core::cloud::PointCloud;
use lidar_deflect_core::frame::Sensor;
use lidar_deflect_core::stream::{Beside, Pair, Reading, ScanOptions, SweepOptions, Taker};
use lidar_deflect_core::sweep::Sweep;
use puck::{Puck, Sent, datagram, scan};

/// All sweeps, written out to the last digit.
#[derive(Default)]
struct Written(Vec<String>);

impl Taker for Written {
    type Kept = PointCloud<Sensor>;

    fn take(&mut self, sweep: &Sweep) {
        self.0.push(format!("{sweep:?}"));
    }
}

fn read_through(sent: &[Sent], reading: &mut impl Reading) {
    for some in sent.chunks(100) {
        let mut batch = DatagramBatch::default();
        some.iter().for_each(|packet| batch.push(&datagram(packet)));
        reading.push(&batch);
    }
    reading.finish();
}

#[test]
fn two_cuts_in_one_reading_give_the_sweeps_of_two() {
    let puck = Puck::default();
    let mut sent = puck.packets(2.0);
    sent.drain(300..310); // some are lost
    let report = scan(&sent, ScanOptions::default());
    let wide = Arc {
        from_rad: 1.0,
        width_rad: 2.0,
    };
    let narrow = || SweepOptions::of(&[0], &[2.0]).towards(&[0], std::iter::once(Some(wide)));
    let thinned = || SweepOptions::of(&[0], &[0.0]).one_in(3);
    let alone = [narrow(), thinned()].map(|options| {
        let mut beside = Beside::new(&report, [(options, Written::default())]).unwrap();
        read_through(&sent, &mut beside);
        beside.into_takers().next().unwrap().0
    });
    let pair = Pair {
        first: Written::default(),
        second: Written::default(),
    };
    let mut both = Beside::new(&report, [(narrow().beside(thinned()), pair)]).unwrap();
    read_through(&sent, &mut both);
    let Pair { first, second } = both.takers().next().unwrap();
    assert!(alone[0].len() > 15 && (5..9).contains(&alone[1].len()));
    assert_eq!(first.0, alone[0]);
    assert_eq!(second.0, alone[1]);
}
