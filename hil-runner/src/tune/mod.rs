//! A tune on disk and on threads: the settings that were looked at. The search itself is [`hil_core::tune`].

pub mod settings_file;
