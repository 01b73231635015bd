//! Enums whose variants are words.

/// An enum whose variants each have a word: `ALL` of them in their order, the `name` of one, and `Display`, which
/// writes it.
///
/// ```
/// palpate_model::named! {
///     /// Which way the load went.
///     #[derive(Clone, Copy)]
///     pub enum Direction {
///         /// Weight after weight is laid on.
///         Loading = "loading",
///         /// Weight after weight is taken off.
///         Unloading = "unloading",
///     }
/// }
/// assert_eq!(Direction::ALL.map(Direction::name), ["loading", "unloading"]);
/// ```
#[macro_export]
macro_rules! named {
    (
        $(#[$about:meta])*
        $vis:vis enum $name:ident { $($(#[$of:meta])* $variant:ident = $word:literal,)* }
    ) => {
        $(#[$about])*
        $vis enum $name { $($(#[$of])* $variant),* }

        #[allow(dead_code, reason = "not every enum needs them all")]
        impl $name {
            /// All of them, in their order.
            $vis const ALL: [Self; [$($word),*].len()] = [$(Self::$variant),*];

            /// The word or words for it.
            #[must_use]
            $vis const fn name(self) -> &'static str {
                match self { $(Self::$variant => $word),* }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }
    };
}
