//! Large datagrams that join 63 packets of an M1 (jumbo); 160 bytes that nothing uses end them.
//!
//! Source: the maker's driver.

use super::header;

/// Packets of a datagram.
const COUNT: usize = 63;
/// Bytes of a packet in it.
pub const PIECE_LEN: usize = 984;
/// Bytes of the datagram.
pub const LEN: usize = COUNT * PIECE_LEN + 160;

/// The packets that a datagram joins; `None` where it is one packet.
pub fn pieces(payload: &[u8]) -> Option<impl Iterator<Item = &[u8]>> {
    let is_joined = payload.len() == LEN && payload.starts_with(&header::ID);
    is_joined.then(|| payload.chunks_exact(PIECE_LEN).take(COUNT))
}

/// Joins packets; missing ones are empty.
pub fn join(pieces: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = vec![0; LEN];
    for (room, piece) in bytes.chunks_exact_mut(PIECE_LEN).zip(pieces).take(COUNT) {
        room[..piece.len().min(PIECE_LEN)].copy_from_slice(&piece[..piece.len().min(PIECE_LEN)]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_joined_comes_apart() {
        assert_eq!(LEN, 62_152);
        let mut piece = header::ID.to_vec();
        piece.resize(PIECE_LEN, 7);
        let joined = join(&vec![piece.clone(); COUNT]);
        let found: Vec<&[u8]> = pieces(&joined).unwrap().collect();
        assert_eq!(found, vec![piece.as_slice(); COUNT]);
        assert!(pieces(&joined[1..]).is_none() && pieces(&piece).is_none());
    }
}
