//! Live plots of streamed variables in the terminal.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use base_link::Line;
use ratatui::Frame;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyModifiers};
use ratatui::layout::{Constraint, Layout};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line as Text, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};

use crate::console_lines::{Said, Splitter};
use crate::interrupt::Interrupted;

/// Seconds that a plot shows.
const WINDOW_S: f64 = 10.0;
const COLOURS: [Color; 6] =
    [Color::Cyan, Color::Yellow, Color::Green, Color::Magenta, Color::Red, Color::Blue];
/// How often the picture is drawn at most.
const REFRESH: Duration = Duration::from_millis(50);

/// Without a character for so long the picture says so.
const SILENCE: Duration = Duration::from_secs(2);

/// One variable's last seconds.
#[derive(Default)]
struct Track {
    points: VecDeque<(f64, f64)>,
}

/// What is drawn.
pub struct Plot {
    names: Vec<String>,
    tracks: Vec<Track>,
    /// Time of the newest values, s.
    now: f64,
    /// Last line that was no values.
    message: String,
    /// Nothing has come for a while.
    silent: bool,
}

impl Plot {
    /// An empty plot of these variables.
    pub fn new(names: &[String]) -> Self {
        let tracks = names.iter().map(|_| Track::default()).collect();
        Self { names: names.to_vec(), tracks, now: 0.0, message: String::new(), silent: false }
    }

    /// The next line of the base.
    pub fn take(&mut self, line: &str) {
        let Said::Stream { ms, values } = Said::of(line) else {
            self.message = line.to_owned();
            return;
        };
        let now = ms / 1000.0;
        if now < self.now {
            // The base began anew.
            self.tracks.iter_mut().for_each(|track| track.points.clear());
        }
        self.now = now;
        for (track, value) in self.tracks.iter_mut().zip(values) {
            track.points.push_back((now, value));
            while track.points.front().is_some_and(|&(then, _)| then < now - WINDOW_S) {
                track.points.pop_front();
            }
        }
    }

    fn range(&self) -> [f64; 2] {
        let values = self.tracks.iter().flat_map(|track| track.points.iter().map(|&(_, v)| v));
        let (low, high) =
            values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return [-1.0, 1.0];
        }
        let margin = ((high - low) * 0.05).max(0.5);
        [low - margin, high + margin]
    }

    /// Draw it.
    pub fn draw(&self, frame: &mut Frame) {
        let [chart, legend] =
            Layout::vertical([Constraint::Min(3), Constraint::Length(1)]).areas(frame.area());
        let points: Vec<Vec<(f64, f64)>> =
            self.tracks.iter().map(|track| track.points.iter().copied().collect()).collect();
        let colour = |n: usize| Style::default().fg(COLOURS[n % COLOURS.len()]);
        let sets = points.iter().enumerate().map(|(n, points)| {
            Dataset::default()
                .marker(Marker::Braille)
                .graph_type(GraphType::Line)
                .style(colour(n))
                .data(points)
        });
        let [low, high] = self.range();
        let first = self.now - WINDOW_S;
        let seconds = [first, self.now].map(|s| format!("{s:.0} s"));
        let values = [low, (low + high) / 2.0, high].map(|v| format!("{v:.1}"));
        let plot = Chart::new(sets.collect())
            .block(Block::bordered().title(" q: end "))
            .x_axis(Axis::default().bounds([first, self.now]).labels(seconds))
            .y_axis(Axis::default().bounds([low, high]).labels(values));
        frame.render_widget(plot, chart);

        let mut spans = Vec::new();
        for (n, (name, track)) in self.names.iter().zip(&self.tracks).enumerate() {
            let value = track.points.back().map_or("-".to_owned(), |(_, v)| v.to_string());
            spans.push(Span::styled(format!(" {name} {value} "), colour(n)));
        }
        if self.silent {
            let warning = Style::default().fg(Color::Red);
            spans.push(Span::styled("  nothing comes: is the base switched on?", warning));
        } else {
            spans.push(Span::raw(format!("  {}", self.message)));
        }
        frame.render_widget(Text::from(spans), legend);
    }
}

/// What a key asks for.
enum Key {
    End,
    Interrupt,
}

fn key() -> Result<Option<Key>> {
    if !event::poll(Duration::ZERO)? {
        return Ok(None);
    }
    let Event::Key(key) = event::read()? else { return Ok(None) };
    Ok(match key.code {
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::Interrupt),
        KeyCode::Char('q' | 'Q') | KeyCode::Esc => Some(Key::End),
        _ => None,
    })
}

/// Plot until somebody types q.
///
/// # Errors
/// [`Interrupted`] after Ctrl-C; if the line is closed; if the terminal cannot be drawn on.
pub fn run(
    line: &mut dyn Line,
    splitter: &mut Splitter,
    names: &[String],
    stop: &AtomicBool,
) -> Result<()> {
    let mut terminal = ratatui::try_init().context("the terminal cannot be drawn on")?;
    let result = (|| {
        let mut plot = Plot::new(names);
        let mut heard = Instant::now();
        loop {
            match key()? {
                Some(Key::End) => return Ok(()),
                Some(Key::Interrupt) => return Err(Interrupted.into()),
                None if stop.load(Ordering::Relaxed) => return Err(Interrupted.into()),
                None => {}
            }
            let bytes = line.receive(REFRESH)?;
            if !bytes.is_empty() {
                heard = Instant::now();
            }
            plot.silent = heard.elapsed() > SILENCE;
            splitter.take(&bytes).iter().for_each(|text| plot.take(text));
            terminal.draw(|frame| plot.draw(frame))?;
        }
    })();
    ratatui::restore();
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    #[test]
    fn a_plot_shows_names_values_and_a_curve() {
        let mut plot = Plot::new(&["speed.left".to_owned(), "speed.right".to_owned()]);
        for n in 0..100 {
            plot.take(&format!("~{},{},{}", n * 100, n, -n));
        }
        plot.take("[9.9 motion info] there");
        let mut terminal = Terminal::new(TestBackend::new(80, 20)).expect("a terminal in memory");
        terminal.draw(|frame| plot.draw(frame)).expect("it draws");
        let text: String =
            terminal.backend().buffer().content().iter().map(|cell| cell.symbol()).collect();
        for word in ["speed.left 99", "speed.right -99", "there", "10 s"] {
            assert!(text.contains(word), "no '{word}' in {text}");
        }
        let dots = text.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
        assert!(dots > 60, "only {dots} cells of curve");
    }

    #[test]
    fn only_the_last_seconds_are_kept_and_a_restart_begins_anew() {
        let mut plot = Plot::new(&["x".to_owned()]);
        for n in 0..300 {
            plot.take(&format!("~{},{}", n * 100, n));
        }
        assert!(plot.tracks[0].points.len() <= 102);
        plot.take("~10,5");
        assert_eq!(plot.tracks[0].points, [(0.01, 5.0)]);
    }
}
