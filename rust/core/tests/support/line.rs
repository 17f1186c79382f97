//! The line from one sensor to the recorder.

use std::net::SocketAddr;

use lidar_deflect_core::capture::Datagram;
use lidar_deflect_core::time::Timestamp;

/// From the moment at which a packet is complete to its arrival.
const DELAY_NS: i64 = 100_000;

/// Hands packets over as datagrams to `port`, in the order given. Each comes with the moment at which
/// it is complete; one that is sent after its successors arrives right behind them.
pub fn deliver(
    port: u16,
    sent: impl IntoIterator<Item = (Timestamp, Vec<u8>)>,
    mut take: impl FnMut(&Datagram<'_>),
) {
    let source: SocketAddr = "192.168.1.201:10000".parse().unwrap();
    let destination = SocketAddr::new("192.168.1.100".parse().unwrap(), port);
    let mut arrival = Timestamp(i64::MIN);
    for (record, (complete, payload)) in (0..).zip(sent) {
        arrival = (complete + DELAY_NS).max(arrival + 1);
        take(&Datagram {
            time: arrival,
            source,
            destination,
            payload: &payload,
            record,
            offset: 0,
        });
    }
}
