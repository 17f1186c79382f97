//! Hesai: blocks of channels between a header and a tail, little endian.
//!
//! Source: the manuals of the models and the maker's development kit.

pub mod at128;
pub mod atx;
pub mod channels;
mod dat;
pub mod date;
pub mod firing;
pub mod ft120;
pub mod jt16;
pub mod layout;
mod modes;
pub mod pandar;
pub mod pandar128;
pub mod qt128;
pub mod rotating;
mod text;
pub mod unit;
pub mod writer;
pub mod xt;
