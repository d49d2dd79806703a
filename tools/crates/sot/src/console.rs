//! `sot console`: the base's serial console.

use std::env;
use std::io::{BufRead, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use base_link::{Line, SerialLine};
use common_sys::constants as c;

use crate::console_lines::{Said, Splitter, streamed_names};
use crate::interrupt::{self, Interrupted};
use crate::output::Usage;
use crate::robot_args::RobotArgs;
use crate::{console_plot, console_terminal};

/// Talk to the base over its serial line
///
/// On a terminal: lines with editing, history and completion (Tab), what the base says in colours.
/// Otherwise, or with COMMAND: each line is sent and the lines of its answer are printed before the next one is sent. The
/// base itself is left in its raw mode, without echo and prompt. K-Team's commands work as well.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot console                                      the only base there is
  sot console --robot serial:/dev/ttyUSB0 --baud 38400
  sot console status version                       two commands and their answers
  echo D,10,10 | sot console --json                from a script
  sot console --json --seconds 5 'stream pose.x,pose.y 20' > run.jsonl
  sot console --plot speed.left,speed.right --hz 20

Exit code 1: the base does not answer. 130: ended by Ctrl-C; on a terminal Ctrl-D ends with 0.")]
pub struct ConsoleArgs {
    /// Commands to send, one after the other
    #[arg(value_name = "COMMAND")]
    commands: Vec<String>,
    #[command(flatten)]
    robot: RobotArgs,
    /// Rate of the line
    #[arg(long, default_value_t = c::BOARD_BAUD, value_parser = clap::value_parser!(u32).range(300..=115_200))]
    baud: u32,
    /// Plot these variables, live, on the terminal
    #[arg(long, value_name = "VARS", conflicts_with_all = ["commands", "json"])]
    plot: Option<String>,
    /// How often the variables are sent
    #[arg(long, default_value_t = 20, requires = "plot", value_parser = clap::value_parser!(u32).range(1..=100))]
    hz: u32,
    /// How long to wait for an answer, in seconds
    #[arg(long, default_value_t = 2.0, value_parser = parse_wait)]
    timeout: f64,
    /// After the last command go on listening for so many seconds
    #[arg(long, default_value_t = 0.0, value_parser = parse_wait)]
    seconds: f64,
    /// Print each line of the base as a JSON object
    #[arg(long)]
    json: bool,
}

/// An answer is over when so long nothing of it came.
const QUIET: Duration = Duration::from_millis(120);
pub const SLICE: Duration = Duration::from_millis(20);
/// Ends what `stream` began, and how its answer begins.
pub const STREAM_OFF: &[u8] = b"stream off\r\n";
pub const STREAM_ENDED: &str = "ok: stream off";

fn parse_wait(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=86_400.0).contains(&seconds) => Ok(seconds),
        _ => Err("write seconds, 0 to 86400".to_owned()),
    }
}

/// Run the verb.
pub fn run(args: &ConsoleArgs) -> Result<()> {
    let path = match turret_link::select::serial_line(args.robot.robot.as_ref()) {
        Ok(path) => path,
        Err(error) if error.is_wrong_use() => return Err(Usage(error.to_string()).into()),
        Err(error) => return Err(error.into()),
    };
    let terminal = std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
    if args.plot.is_some() && !terminal {
        return Err(
            Usage("plots need a terminal; --json captures variables without one".into()).into()
        );
    }
    let mut line = SerialLine::open(&path, args.baud)?;
    // The base says XOFF when its queue is nearly full.
    line.flow_control(true)?;
    if let Some(variables) = &args.plot {
        return plot(&mut line, variables, args);
    }
    if args.commands.is_empty() && terminal {
        let patience = Duration::from_secs_f64(args.timeout);
        return console_terminal::run(line, &path, args.baud, patience, Output::new(args.json));
    }
    let stop = interrupt::watch();
    let mut talk = Talk::new(&mut line, args, stop);
    if args.commands.is_empty() {
        for command in std::io::stdin().lock().lines() {
            talk.ask(&command.context("cannot read standard input")?)?;
        }
    } else {
        args.commands.iter().try_for_each(|command| talk.ask(command))?;
    }
    talk.listen(Duration::from_secs_f64(args.seconds))?;
    talk.end()
}

/// Commands and their answers, one after the other.
struct Talk<'a> {
    line: &'a mut dyn Line,
    splitter: Splitter,
    output: Output,
    patience: Duration,
    stop: &'a AtomicBool,
    asked: bool,
    answered: bool,
    streaming: bool,
}

impl<'a> Talk<'a> {
    fn new(line: &'a mut dyn Line, args: &ConsoleArgs, stop: &'a AtomicBool) -> Self {
        Self {
            line,
            splitter: Splitter::default(),
            output: Output::new(args.json),
            patience: Duration::from_secs_f64(args.timeout),
            stop,
            asked: false,
            answered: false,
            streaming: false,
        }
    }

    /// Send a command, print what is answered.
    fn ask(&mut self, command: &str) -> Result<()> {
        let command = command.trim_end();
        self.streaming |= command.trim_start().starts_with("stream");
        self.line.send(format!("{command}\r\n").as_bytes())?;
        if command.is_empty() {
            return Ok(()); // an empty line is answered by nothing
        }
        self.asked = true;
        let mut heard: Option<Instant> = None;
        let started = Instant::now();
        while started.elapsed() < self.patience && heard.is_none_or(|then| then.elapsed() < QUIET) {
            if self.receive()? {
                heard = Some(Instant::now());
            }
        }
        self.answered |= heard.is_some();
        Ok(())
    }

    /// Print what comes in a moment; whether some of it may be an answer.
    fn receive(&mut self) -> Result<bool> {
        if self.stop.load(Ordering::Relaxed) {
            self.silence();
            return Err(Interrupted.into());
        }
        let bytes = self.line.receive(SLICE)?;
        let mut answer = false;
        for text in self.splitter.take(&bytes) {
            answer |= self.output.show(&text)?;
        }
        Ok(answer)
    }

    fn listen(&mut self, duration: Duration) -> Result<()> {
        let started = Instant::now();
        while started.elapsed() < duration {
            self.receive()?;
        }
        Ok(())
    }

    fn silence(&mut self) {
        if self.streaming {
            end_stream(self.line, &mut self.splitter, self.patience);
        }
    }

    fn end(mut self) -> Result<()> {
        // Half a line of variables is of no use; half an answer may be.
        if let Some(text) = self.splitter.rest().filter(|text| !text.starts_with('~')) {
            self.output.show(&text)?;
            self.answered = true;
        }
        self.silence();
        if self.asked && !self.answered {
            bail!(
                "the base does not answer; is it switched on, and is the line's rate right (--baud)?"
            );
        }
        Ok(())
    }
}

/// Whoever comes next shall not find variables streaming, nor the answer to our ending them. If the line
/// is gone there is nothing to end.
fn end_stream(line: &mut dyn Line, splitter: &mut Splitter, patience: Duration) {
    if line.send(STREAM_OFF).is_err() {
        return;
    }
    let started = Instant::now();
    while started.elapsed() < patience {
        let Ok(bytes) = line.receive(SLICE) else { return };
        if splitter.take(&bytes).iter().any(|text| text.starts_with(STREAM_ENDED)) {
            return;
        }
    }
}

/// How lines are shown.
pub struct Output {
    json: bool,
    /// Whether the terminal is to show colours.
    pub colours: bool,
    started: Instant,
    names: Vec<String>,
}

impl Output {
    fn new(json: bool) -> Self {
        let colours = std::io::stdout().is_terminal() && env::var_os("NO_COLOR").is_none();
        Self { json, colours, started: Instant::now(), names: vec![] }
    }

    /// A line as it is shown, and what it is.
    pub fn render(&mut self, text: &str) -> (String, Said) {
        if let Some(names) = streamed_names(text) {
            self.names = names;
        }
        let said = Said::of(text);
        let shown = if self.json {
            said.as_json(self.started.elapsed().as_secs_f64(), text, &self.names).to_string()
        } else if self.colours {
            said.coloured(text)
        } else {
            text.to_owned()
        };
        (shown, said)
    }

    /// Print a line; whether it is an answer, not something that comes by itself.
    fn show(&mut self, text: &str) -> Result<bool> {
        let (shown, said) = self.render(text);
        let mut output = std::io::stdout().lock();
        writeln!(output, "{shown}").and_then(|()| output.flush()).context("cannot print")?;
        Ok(matches!(said, Said::Reply | Said::Error))
    }
}

fn plot(line: &mut SerialLine, variables: &str, args: &ConsoleArgs) -> Result<()> {
    let stop = interrupt::watch();
    line.send(format!("stream {variables} {}\r\n", args.hz).as_bytes())?;
    let patience = Duration::from_secs_f64(args.timeout);
    let started = Instant::now();
    let mut splitter = Splitter::default();
    let mut names = None;
    while names.is_none() && started.elapsed() < patience {
        for text in splitter.take(&line.receive(SLICE)?) {
            if Said::of(&text) == Said::Error {
                bail!("the base says: {text}");
            }
            names = names.or_else(|| streamed_names(&text));
        }
    }
    let names = names.context("the base does not answer; is the line's rate right (--baud)?")?;
    let result = console_plot::run(line, &mut splitter, &names, stop);
    end_stream(line, &mut splitter, patience);
    result
}
