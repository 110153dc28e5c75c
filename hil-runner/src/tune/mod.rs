//! A tune on disk and on threads: settings that were looked at, and the file with the gains
//! that were found. The search itself is [`hil_core::tune`].

pub mod settings_file;
pub mod tuned_file;
