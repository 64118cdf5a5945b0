//! What is said on standard error: how much of it, and what a line looks like.
//!
//! The flags `-v` and `-q` come in; from then on `tracing`'s events go to standard error, one line each. Imports
//! nothing of donut.

use std::fmt;
use std::io::{IsTerminal, stderr};

use clap::{ArgAction, Args};
use tracing::{Event, Level, Subscriber, level_filters::LevelFilter};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::format::{FormatEvent, FormatFields, Writer};
use tracing_subscriber::fmt::{FmtContext, layer};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::{LookupSpan, Registry};

/// Flags about what is said on standard error.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct LogArgs {
    /// Say more on standard error: -v a line for each stage, -vv for each try, file and request, -vvv everything.
    #[arg(short, long, global = true, action = ArgAction::Count, conflicts_with = "quiet", display_order = 900)]
    verbose: u8,
    /// Say nothing on standard error but errors: no progress, no warnings.
    #[arg(short, long, global = true, display_order = 901)]
    quiet: bool,
}

impl LogArgs {
    /// From here on events are shown. Only the first call in a process counts.
    pub fn start(self) {
        let level = self.level(stderr().is_terminal());
        // Libraries speak only where everything is wanted.
        let others = if level == LevelFilter::TRACE { LevelFilter::DEBUG } else { LevelFilter::OFF };
        let targets = Targets::new().with_target("donut", level).with_default(others);
        let lines = layer().with_writer(stderr).event_format(Line).with_ansi(false);
        // A subscriber that is already there belongs to whoever calls this as a library.
        let _ = tracing::subscriber::set_global_default(Registry::default().with(targets).with(lines));
    }

    /// The least urgent events that are shown. What a terminal shows without being asked, a log file does not need.
    fn level(self, terminal: bool) -> LevelFilter {
        match (self.quiet, self.verbose) {
            (true, _) => LevelFilter::ERROR,
            (false, 0) if terminal => LevelFilter::INFO,
            (false, 0) => LevelFilter::WARN,
            (false, 1) => LevelFilter::INFO,
            (false, 2) => LevelFilter::DEBUG,
            (false, _) => LevelFilter::TRACE,
        }
    }
}

/// Whether progress may be shown at all.
pub fn is_quiet() -> bool {
    !tracing::enabled!(Level::WARN)
}

/// `warning: ..`, `debug: ..`, and plain text for what is neither.
struct Line;

impl<S, N> FormatEvent<S, N> for Line
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        let metadata = event.metadata();
        match *metadata.level() {
            Level::ERROR => write!(writer, "error: ")?,
            Level::WARN => write!(writer, "warning: ")?,
            Level::INFO => {}
            Level::DEBUG | Level::TRACE if !metadata.target().starts_with("donut") => {
                write!(writer, "debug: {}: ", metadata.target())?;
            }
            Level::DEBUG | Level::TRACE => write!(writer, "debug: ")?,
        }
        context.field_format().format_fields(writer.by_ref(), event)?;
        writeln!(writer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_much_is_said() {
        let level = |quiet, verbose, terminal| LogArgs { verbose, quiet }.level(terminal);
        assert_eq!(level(false, 0, false), LevelFilter::WARN);
        assert_eq!(level(false, 0, true), LevelFilter::INFO);
        assert_eq!(level(true, 0, true), LevelFilter::ERROR);
        assert_eq!(
            [1, 2, 3, 4].map(|v| level(false, v, false)),
            [LevelFilter::INFO, LevelFilter::DEBUG, LevelFilter::TRACE, LevelFilter::TRACE]
        );
    }
}
