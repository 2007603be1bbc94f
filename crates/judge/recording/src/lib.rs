//! A recorded run: the layout of its folder, and how it is written, found, verified and read.
//!
//! `layout` names the files. A launcher writes with `write`, `events`, `verdict`, `replays` and, last of all, `anchors`. A command finds runs
//! with `find` and opens one with [`Checked`], after `verify`: it compares every byte and the whole log with the anchors, and `log` judges
//! the entries. A `Checked` opens the log at times of the run (`recorded_log`), the `messages` between services and the `replays`; `read`
//! has the raw readers, which stay inside this crate.
//!
//! The MCAP files are written and read frame by frame in `link` (`recorder`, `mcap_frames`), as are the input journals; the types that the
//! judge reads are in `evidence`. Running a trial is left to `twin` and `live`; options, exit codes and the results around a run are left to
//! `runner`.

pub mod anchors;
pub mod checked;
mod error;
pub mod events;
pub mod find;
pub mod layout;
pub mod log;
pub mod messages;
mod read;
pub mod recorded_log;
pub mod replays;
pub mod verdict;
pub mod verify;
pub mod write;

pub use checked::Checked;
pub use error::RecordingError;
pub use layout::RunFolder;
pub use read::read_site;
pub use recorded_log::RecordedLog;
