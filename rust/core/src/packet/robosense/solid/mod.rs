//! Sensors without a rotor (M1 to MX, E1, EMX, EM4): mirrors and arrays that send frame after frame, big
//! endian. The number of a packet starts again with every frame.
//!
//! Sources: the maker's driver; its manuals of E1, EMX and EM4. A packet of one of the M series says where
//! each point is; E1 as well. EMX and EM4 tell the yaw of a column, and the pitch of their rows in packets
//! of their own (DIFOP2).

pub mod blocks;
pub mod columns;
mod decoder;
pub mod description;
pub mod header;
pub mod joined;
pub mod sensor;
