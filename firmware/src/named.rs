//! Enumerations whose values have names in reports and files, and numbers on a line.

/// An enumeration, each value beside its name.
macro_rules! named {
    (
        $(#[$about:meta])*
        pub enum $name:ident {
            $($(#[$of_value:meta])* $value:ident = $text:literal,)*
        }
    ) => {
        $(#[$about])*
        pub enum $name {
            $($(#[$of_value])* $value,)*
        }

        impl $name {
            /// All of them, in their order.
            pub const ALL: [Self; [$($text),*].len()] = [$(Self::$value),*];

            /// The name in reports and files.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$value => $text,)*
                }
            }

            /// The place in the list of all.
            #[allow(clippy::as_conversions, reason = "there are few of them, without fields")]
            pub const fn number(self) -> u8 {
                self as u8
            }
        }
    };
}

pub(crate) use named;
