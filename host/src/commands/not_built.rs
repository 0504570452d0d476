//! Commands that are not in this build: each says how to get it.

/// Writes a module for each command, as far as its feature is off: it takes any arguments, and refuses them.
macro_rules! not_built {
    ($($name:ident, $feature:literal, $words:literal;)*) => {
        $(
            #[cfg(not(feature = $feature))]
            pub(crate) mod $name {
                use crate::commands::Outcome;

                #[doc = concat!($words, " [not in this build: it takes `--features ", $feature, "`]")]
                #[derive(clap::Args)]
                #[command(disable_help_flag = true)]
                pub(crate) struct Arguments {
                    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
                    _arguments: Vec<std::ffi::OsString>,
                }

                /// Says how to get the command.
                pub(crate) fn run(_: &Arguments) -> anyhow::Result<Outcome> {
                    anyhow::bail!(concat!(
                        "this build has no `", stringify!($name), "`; build it in: `cargo run --release --features ",
                        $feature, " -- ", stringify!($name), "` and the same arguments (`--features full` has all but `flash`)"
                    ))
                }
            }
        )*
    };
}

not_built! {
    flash, "probe", "Check a firmware image and write it to the hand's microcontroller over a debug probe";
    monitor, "monitor", "Watch a hand or a recording in the terminal, and operate it";
    paper, "paper", "Run the paper's simulations and check what it says";
    sweep, "sweep", "Run a scene over a grid of settings, on all cores";
}
