//! `sot console` for a person at a terminal: lines with editing, history and completion below, what the
//! base says above them.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{env, fs, thread};

use anyhow::{Context as _, Result, anyhow};
use base_link::{Line, SerialLine};
use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::highlight::Highlighter;
use rustyline::hint::Hinter;
use rustyline::history::FileHistory;
use rustyline::validate::Validator;
use rustyline::{CompletionType, Context, Editor, ExternalPrinter, Helper};

use crate::console::{Output, SLICE, STREAM_ENDED, STREAM_OFF};
use crate::console_lines::{Said, Splitter};
use crate::interrupt::Interrupted;

const HISTORY_MAX: usize = 1000;
const PROMPT: &str = "base> ";
/// The base's answer to `words LINE`: lines that begin with the first, and the last one.
const WORDS: &str = "words:";
const WORDS_END: &str = "ok: words";
/// What another program than ours says to it.
const NO_WORDS: [&str; 2] = ["error: no such command", "z,"];

/// What the terminal's side and the line's side share.
#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    /// A question for words that is under way, and what has come of its answer.
    words: Option<Vec<String>>,
    words_ended: bool,
    /// When a line was sent that has not been answered yet.
    asked: Option<Instant>,
    /// Why nothing comes any more.
    closed: Option<String>,
    /// We are about to end, and nothing is shown any more.
    leaving: bool,
    stream_ended: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked has left it whole: each change is one assignment.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    /// Whoever comes next shall not find variables streaming, nor the answer to our ending them.
    fn wait_for_stream_end(&self, patience: Duration) {
        let mut state = self.lock();
        state.leaving = true;
        let goes_on = |state: &mut State| !state.stream_ended && state.closed.is_none();
        drop(self.changed.wait_timeout_while(state, patience, goes_on));
    }
}

impl State {
    /// Takes a line that belongs to the answer of a question for words.
    fn takes(&mut self, text: &str) -> bool {
        let Some(words) = &mut self.words else { return false };
        if let Some(names) = text.strip_prefix(WORDS) {
            words.extend(names.split_whitespace().map(str::to_owned));
            return true;
        }
        self.words_ended |=
            text == WORDS_END || NO_WORDS.iter().any(|answer| text.starts_with(answer));
        self.words_ended
    }
}

/// Talk until Ctrl-D.
///
/// # Errors
/// [`Interrupted`] after Ctrl-C; if the line is closed or the terminal cannot be used.
pub fn run(
    mut line: SerialLine,
    path: &Path,
    baud: u32,
    patience: Duration,
    output: Output,
) -> Result<()> {
    let settings = rustyline::Config::builder()
        .max_history_size(HISTORY_MAX)?
        .completion_type(CompletionType::List)
        .build();
    let unusable = "cannot use the terminal";
    let mut editor: Editor<Keys, FileHistory> = Editor::with_config(settings).context(unusable)?;
    let shared = Arc::new(Shared::default());
    let colours = output.colours;
    let words =
        Words { line: line.try_clone()?, shared: shared.clone(), known: HashMap::new(), patience };
    editor.set_helper(Some(Keys { words: Mutex::new(words), colours }));
    let history = history_file();
    if let Some(file) = &history {
        // The first time there is none.
        let _ = editor.load_history(file);
    }
    println!(
        "{} at {baud} baud: `help` lists the base's commands, Tab completes, Ctrl-D ends",
        path.display()
    );
    let printer = editor.create_external_printer().context(unusable)?;
    let listener = Listener { line: line.try_clone()?, shared: shared.clone(), output, patience };
    // Ends with the program: it only waits for the line.
    thread::spawn(move || listener.run(printer));
    let mut streaming = false;
    let result = loop {
        let read = editor.readline(PROMPT);
        if let Some(why) = shared.lock().closed.take() {
            break Err(anyhow!(why));
        }
        match read {
            Ok(text) => {
                let text = text.trim_end();
                streaming |= text.trim_start().starts_with("stream");
                if !text.trim().is_empty() {
                    editor.add_history_entry(text)?;
                    shared.lock().asked = Some(Instant::now());
                }
                if let Some(file) = &history {
                    // Each line at once: a terminal may be closed at any time.
                    let kept = editor.append_history(file);
                    kept.with_context(|| format!("cannot write {}", file.display()))?;
                }
                line.send(format!("{text}\r\n").as_bytes())?;
            }
            Err(ReadlineError::Eof) => break Ok(()),
            Err(ReadlineError::Interrupted) => break Err(Interrupted.into()),
            Err(error) => break Err(error.into()),
        }
    };
    if streaming && line.send(STREAM_OFF).is_ok() {
        shared.wait_for_stream_end(patience);
    }
    result
}

/// Where typed lines are kept, if there is a home for them.
fn history_file() -> Option<PathBuf> {
    let state =
        env::var_os("XDG_STATE_HOME").filter(|folder| !folder.is_empty()).map(PathBuf::from);
    let state = state.or_else(|| Some(PathBuf::from(env::var_os("HOME")?).join(".local/state")))?;
    let folder = state.join("stereosot");
    fs::create_dir_all(&folder).ok()?;
    Some(folder.join("console_history"))
}

/// Prints what the base says.
struct Listener {
    line: SerialLine,
    shared: Arc<Shared>,
    output: Output,
    patience: Duration,
}

impl Listener {
    fn run(mut self, mut printer: impl ExternalPrinter) {
        let mut splitter = Splitter::default();
        loop {
            let bytes = match self.line.receive(SLICE) {
                Ok(bytes) => bytes,
                Err(error) => {
                    let _ = printer.print(self.warning(&format!("{error} (Enter ends)")));
                    self.shared.lock().closed = Some(error.to_string());
                    self.shared.changed.notify_all();
                    return;
                }
            };
            for text in splitter.take(&bytes) {
                if let Some(shown) = self.take(&text)
                    && printer.print(format!("{shown}\n")).is_err()
                {
                    return;
                }
            }
            if self.lost_patience() {
                let warning =
                    "no answer; is the base switched on, and the line's rate right (--baud)?";
                let _ = printer.print(self.warning(warning));
            }
        }
    }

    /// What is shown of a line.
    fn take(&mut self, text: &str) -> Option<String> {
        let mut state = self.shared.lock();
        state.stream_ended = state.leaving && text.starts_with(STREAM_ENDED);
        if state.takes(text) || state.leaving {
            self.shared.changed.notify_all();
            return None;
        }
        let (shown, said) = self.output.render(text);
        if matches!(said, Said::Reply | Said::Error) {
            state.asked = None;
        }
        Some(shown)
    }

    /// Once for each line that is not answered.
    fn lost_patience(&self) -> bool {
        let mut state = self.shared.lock();
        let lost = state.asked.is_some_and(|asked| asked.elapsed() > self.patience);
        if lost {
            state.asked = None;
        }
        lost
    }

    fn warning(&self, text: &str) -> String {
        if self.output.colours {
            format!("\x1b[33msot: {text}\x1b[0m\n")
        } else {
            format!("sot: {text}\n")
        }
    }
}

/// What may follow a beginning of a line, as the base knows it; asked for when Tab is pressed.
struct Words {
    line: SerialLine,
    shared: Arc<Shared>,
    known: HashMap<String, Vec<String>>,
    patience: Duration,
}

impl Words {
    fn after(&mut self, before: &str) -> Vec<String> {
        if let Some(words) = self.known.get(before) {
            return words.clone();
        }
        let words = self.ask(before);
        if !words.is_empty() {
            self.known.insert(before.to_owned(), words.clone());
        }
        words
    }

    /// What has come within `patience` of the last of it.
    fn ask(&mut self, before: &str) -> Vec<String> {
        let mut state = self.shared.lock();
        (state.words, state.words_ended) = (Some(Vec::new()), false);
        if self.line.send(format!("words {before}\r\n").as_bytes()).is_ok() {
            while !state.words_ended && state.closed.is_none() {
                let waited = self.shared.changed.wait_timeout(state, self.patience);
                let (now, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
                state = now;
                if timeout.timed_out() {
                    break;
                }
            }
        }
        state.words.take().unwrap_or_default()
    }
}

/// What the line editor asks about the line being typed.
struct Keys {
    words: Mutex<Words>,
    colours: bool,
}

/// Where the word at `position` begins, and the words before it that say what it may be. None: it is
/// nothing that is completed.
fn word_at(line: &str, position: usize) -> Option<(usize, String)> {
    let typed = line.get(..position)?;
    if !typed.trim_start().is_empty()
        && !typed.trim_start().starts_with(|c: char| c.is_ascii_lowercase())
    {
        return None; // K-Team's protocol
    }
    let start = typed.rfind([' ', ',']).map_or(0, |at| at + 1);
    let before: Vec<&str> = typed[..start].split([' ', ',']).filter(|w| !w.is_empty()).collect();
    Some((start, before[..before.len().min(2)].join(" ")))
}

impl Completer for Keys {
    type Candidate = String;

    fn complete(
        &self,
        line: &str,
        position: usize,
        _: &Context<'_>,
    ) -> rustyline::Result<(usize, Vec<String>)> {
        let Some((start, before)) = word_at(line, position) else { return Ok((position, vec![])) };
        let begun = &line[start..position];
        let mut words = self.words.lock().unwrap_or_else(PoisonError::into_inner);
        let mut fitting = words.after(&before);
        fitting.retain(|word| word.starts_with(begun));
        // Variables of `stream` are followed by a comma as well.
        if let [only] = fitting.as_mut_slice()
            && !before.starts_with("stream")
        {
            only.push(' ');
        }
        Ok((start, fitting))
    }
}

impl Hinter for Keys {
    type Hint = String;
}

impl Highlighter for Keys {
    fn highlight_prompt<'b, 's: 'b, 'p: 'b>(&'s self, prompt: &'p str, _: bool) -> Cow<'b, str> {
        if self.colours {
            Cow::Owned(format!("\x1b[1;32m{prompt}\x1b[0m"))
        } else {
            Cow::Borrowed(prompt)
        }
    }
}

impl Validator for Keys {}

impl Helper for Keys {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_is_completed_by_what_stands_before_it() {
        let word = |line: &str| word_at(line, line.len());
        assert_eq!(word("sta"), Some((0, String::new())));
        assert_eq!(word("set spe"), Some((4, "set".into())));
        assert_eq!(word("stream a,b,"), Some((11, "stream a".into())));
        assert_eq!(word("D,1"), None);
        assert_eq!(word_at("get x", 4), Some((4, "get".into())));
    }

    #[test]
    fn only_the_answer_to_a_question_for_words_is_kept_back() {
        let mut state = State::default();
        assert!(!state.takes("words: a b"), "nobody asked");
        state.words = Some(vec![]);
        assert!(!state.takes("h,1,2") && !state.takes("ok: saved"));
        assert!(state.takes("words: help status") && state.takes("words: stop"));
        assert!(!state.words_ended);
        assert!(state.takes("ok: words") && state.words_ended);
        assert_eq!(state.words.as_deref(), Some(&["help", "status", "stop"].map(String::from)[..]));
    }
}
