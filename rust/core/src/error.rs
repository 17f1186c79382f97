//! One error per family; each says where it was, what was expected and what was found.

use thiserror::Error;

/// What every error of the library tells beside its message.
pub trait Coded: std::error::Error {
    /// Stable name of the kind of failure, such as `capture.truncated`.
    fn code(&self) -> &'static str;

    /// One next step for the user.
    fn hint(&self) -> Option<String> {
        None
    }
}

/// An argument or parameter outside of what its meaning allows.
#[derive(Debug, Clone, Error, PartialEq)]
#[error("{name}: expected {expected}, found {found}")]
pub struct InvalidValue {
    /// Name of the parameter as the caller knows it.
    pub name: &'static str,
    /// What would have been accepted.
    pub expected: String,
    /// What was given.
    pub found: String,
}

impl Coded for InvalidValue {
    fn code(&self) -> &'static str {
        "value.invalid"
    }
}
