//! Facts: events of a log, as other parts of the judge read them.

pub(crate) mod contact;
pub(crate) mod guest;
pub(crate) mod link;
pub(crate) mod motion;
pub mod peers;
pub(crate) mod place;
pub(crate) mod progress;
pub(crate) mod sensor_fault;
pub(crate) mod timeline;
