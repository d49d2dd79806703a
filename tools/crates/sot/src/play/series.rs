//! Many matches, one seed after the other: a line of CSV each, and what they come to together.
//!
//! Matches do not know of each other, so a row is what `sot play` with its seed and the same options
//! gives alone; jobs only decide how many are played at once.

use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Value, json};
use sim::{MS, SECOND};
use twin::game::{Game, Setup, Summary};
use twin::tally::{Detection, Errors, Samples};

use super::stats::{Estimate, mean, median, share};
use crate::interrupt::{self, Interrupted};

/// The columns of the CSV; empty where there is nothing to say.
const COLUMNS: &str = "seed,goals_for,goals_against,own_goals,sim_seconds,time_to_ball_s,\
    time_to_goal_s,frames,reports,ball_visible,ball_found,ball_wrong,goal_visible,goal_found,\
    opponent_visible,opponent_found,ball_range_error_p50_percent,ball_range_error_p90_percent,\
    ball_bearing_error_p50_deg,ball_bearing_error_p90_deg,goal_range_error_p50_percent,\
    goal_range_error_p90_percent,opponent_range_error_p50_percent,\
    opponent_range_error_p90_percent,stuck_s,exposure_to_pwm_p50_ms,exposure_to_pwm_p99_ms,\
    report_to_pwm_p50_ms,report_to_pwm_p99_ms,cpu_load,trace_hash";

/// Matches of the seeds from `setup.seed` on.
pub struct Series<'a> {
    pub setup: &'a Setup,
    pub matches: u64,
    pub jobs: usize,
    pub csv: Option<&'a Path>,
    pub show: bool,
}

/// Rows as they are finished, written in the order of their seeds.
struct Rows {
    file: Option<File>,
    finished: Vec<Option<Summary>>,
    written: usize,
    first_seed: u64,
}

impl Rows {
    fn finish(&mut self, index: usize, summary: Summary) -> Result<()> {
        self.finished[index] = Some(summary);
        while let Some(Some(summary)) = self.finished.get(self.written) {
            if let Some(file) = &mut self.file {
                let seed = self.first_seed + self.written as u64;
                writeln!(file, "{}", row(seed, summary)).context("cannot write the CSV")?;
            }
            self.written += 1;
        }
        Ok(())
    }
}

/// What a series came to.
pub struct Outcome {
    pub first_seed: u64,
    pub summaries: Vec<Summary>,
    pub host_seconds: f64,
}

impl Series<'_> {
    /// Play them all.
    pub fn play(&self) -> Result<Outcome> {
        let stop = interrupt::watch();
        let file = match self.csv {
            Some(path) => {
                let named = || format!("cannot write {}", path.display());
                let mut file = File::create(path).with_context(named)?;
                writeln!(file, "{COLUMNS}").with_context(named)?;
                Some(file)
            }
            None => None,
        };
        let rows = Mutex::new(Rows {
            file,
            finished: vec![None; self.matches as usize],
            written: 0,
            first_seed: self.setup.seed,
        });
        let bar = self.bar();
        let started = Instant::now();
        let next = AtomicU64::new(0);
        let worker = || -> Result<()> {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= self.matches {
                    return Ok(());
                }
                let Some(summary) = self.play_one(self.setup.seed + index, stop)? else {
                    return Err(Interrupted.into());
                };
                rows.lock()
                    .map_err(|_| anyhow::anyhow!("another job failed"))?
                    .finish(index as usize, summary)?;
                bar.inc(1);
            }
        };
        thread::scope(|scope| {
            let jobs: Vec<_> = (0..self.jobs).map(|_| scope.spawn(worker)).collect();
            jobs.into_iter().try_for_each(|job| match job.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })?;
        bar.finish_and_clear();
        let rows = rows.into_inner().map_err(|_| anyhow::anyhow!("a job failed"))?;
        Ok(Outcome {
            first_seed: self.setup.seed,
            summaries: rows.finished.into_iter().flatten().collect(),
            host_seconds: started.elapsed().as_secs_f64(),
        })
    }

    /// None if it was interrupted.
    fn play_one(&self, seed: u64, stop: &AtomicBool) -> Result<Option<Summary>> {
        let mut game = Game::new(Setup { seed, ..self.setup.clone() })?;
        while !game.over() {
            if stop.load(Ordering::Relaxed) {
                return Ok(None);
            }
            game.run_for(100 * MS);
        }
        Ok(Some(game.summary()))
    }

    fn bar(&self) -> ProgressBar {
        let bar = ProgressBar::new(self.matches);
        let shown = self.show && std::io::stderr().is_terminal();
        bar.set_draw_target(if shown {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        });
        bar.set_style(
            ProgressStyle::with_template("{bar:40} {pos} of {len} matches, {eta} left")
                .expect("the template is constant and right"),
        );
        bar
    }
}

fn seconds(time: sim::Ps) -> f64 {
    time as f64 / SECOND as f64
}

/// A number, or nothing.
fn cell(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!("{value:.3}"))
}

fn row(seed: u64, summary: &Summary) -> String {
    let tally = &summary.tally;
    let p = |samples: &Samples, share: f64| cell(samples.percentile(share));
    let cells = [
        seed.to_string(),
        summary.goals_for.to_string(),
        summary.goals_against.to_string(),
        summary.own_goals.to_string(),
        cell(Some(seconds(summary.time))),
        cell(summary.time_to_ball.map(seconds)),
        cell(summary.time_to_goal.map(seconds)),
        summary.frames.to_string(),
        summary.reports.to_string(),
        tally.ball.visible.to_string(),
        tally.ball.found.to_string(),
        tally.ball.wrong.to_string(),
        tally.goal.visible.to_string(),
        tally.goal.found.to_string(),
        tally.opponent.visible.to_string(),
        tally.opponent.found.to_string(),
        p(&tally.ball_errors.range_percent, 0.5),
        p(&tally.ball_errors.range_percent, 0.9),
        p(&tally.ball_errors.bearing_deg, 0.5),
        p(&tally.ball_errors.bearing_deg, 0.9),
        p(&tally.goal_errors.range_percent, 0.5),
        p(&tally.goal_errors.range_percent, 0.9),
        p(&tally.opponent_errors.range_percent, 0.5),
        p(&tally.opponent_errors.range_percent, 0.9),
        cell(Some(f64::from(tally.stuck_ms) / 1000.0)),
        p(&tally.exposure_to_pwm_ms, 0.5),
        p(&tally.exposure_to_pwm_ms, 0.99),
        p(&tally.report_to_pwm_ms, 0.5),
        p(&tally.report_to_pwm_ms, 0.99),
        cell(Some(summary.cpu_load)),
        format!("{:016x}", summary.trace_hash),
    ];
    cells.join(",")
}

fn samples_as_json(samples: &Samples) -> Value {
    json!({
        "count": samples.len(),
        "p50": samples.percentile(0.5),
        "p90": samples.percentile(0.9),
        "p99": samples.percentile(0.99),
    })
}

/// A number for people.
fn number(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), |value| format!("{value:.1}"))
}

/// Sums and merged measurements of a series.
pub struct Together {
    matches: usize,
    goals_for: u32,
    goals_against: u32,
    own_goals: u32,
    scored: Option<Estimate>,
    difference: Option<Estimate>,
    to_ball: Vec<f64>,
    to_goal: Vec<f64>,
    sim_seconds: f64,
    stuck_s: f64,
    cpu_load_most: f64,
    ball: Detection,
    goal: Detection,
    opponent: Detection,
    ball_errors: Errors,
    goal_errors: Errors,
    opponent_errors: Errors,
    exposure_to_pwm: Samples,
    report_to_pwm: Samples,
    factor: f64,
}

fn add(sum: &mut Detection, more: &Detection) {
    sum.visible += more.visible;
    sum.found += more.found;
    sum.wrong += more.wrong;
}

impl Outcome {
    /// All matches put together.
    pub fn together(&self) -> Together {
        let all = &self.summaries;
        let sum = |count: fn(&Summary) -> u32| all.iter().map(count).sum::<u32>();
        let differences: Vec<f64> =
            all.iter().map(|s| f64::from(s.goals_for) - f64::from(s.goals_against)).collect();
        let sim_seconds = all.iter().map(|s| seconds(s.time)).sum::<f64>();
        let mut together = Together {
            matches: all.len(),
            goals_for: sum(|s| s.goals_for),
            goals_against: sum(|s| s.goals_against),
            own_goals: sum(|s| s.own_goals),
            scored: share(all.iter().filter(|s| s.goals_for > 0).count(), all.len()),
            difference: mean(&differences),
            to_ball: all.iter().filter_map(|s| s.time_to_ball).map(seconds).collect(),
            to_goal: all.iter().filter_map(|s| s.time_to_goal).map(seconds).collect(),
            sim_seconds,
            stuck_s: f64::from(sum(|s| s.tally.stuck_ms)) / 1000.0,
            cpu_load_most: all.iter().map(|s| s.cpu_load).fold(0.0, f64::max),
            ball: Detection::default(),
            goal: Detection::default(),
            opponent: Detection::default(),
            ball_errors: Errors::default(),
            goal_errors: Errors::default(),
            opponent_errors: Errors::default(),
            exposure_to_pwm: Samples::default(),
            report_to_pwm: Samples::default(),
            factor: sim_seconds / self.host_seconds,
        };
        for summary in all {
            together.add(summary);
        }
        together
    }
}

impl Together {
    fn add(&mut self, summary: &Summary) {
        let tally = &summary.tally;
        add(&mut self.ball, &tally.ball);
        add(&mut self.goal, &tally.goal);
        add(&mut self.opponent, &tally.opponent);
        self.ball_errors.extend(&tally.ball_errors);
        self.goal_errors.extend(&tally.goal_errors);
        self.opponent_errors.extend(&tally.opponent_errors);
        self.exposure_to_pwm.extend(&tally.exposure_to_pwm_ms);
        self.report_to_pwm.extend(&tally.report_to_pwm_ms);
    }

    /// Of one match, whose speed is of no interest here.
    pub fn of(seed: u64, summary: &Summary) -> Self {
        let summaries = vec![summary.clone()];
        Outcome { first_seed: seed, summaries, host_seconds: f64::NAN }.together()
    }

    /// What was found of what is visible.
    pub fn detection_as_json(&self) -> Value {
        let detection = |d: &Detection| json!({"visible": d.visible, "found": d.found, "wrong": d.wrong, "rate": d.rate()});
        json!({
            "ball": detection(&self.ball),
            "goal": detection(&self.goal),
            "opponent": detection(&self.opponent),
        })
    }

    /// How far what was believed is from the truth.
    pub fn belief_as_json(&self) -> Value {
        let errors = |e: &Errors| {
            json!({
                "range_percent": samples_as_json(&e.range_percent),
                "bearing_deg": samples_as_json(&e.bearing_deg),
            })
        };
        json!({
            "ball": errors(&self.ball_errors),
            "goal": errors(&self.goal_errors),
            "opponent": errors(&self.opponent_errors),
        })
    }

    /// One object with all of it.
    pub fn as_json(&self) -> Value {
        let interval = |estimate: &Option<Estimate>| {
            estimate.map(|e| json!({"value": e.value, "low": e.low, "high": e.high}))
        };
        json!({
            "matches": self.matches,
            "goals_for": self.goals_for,
            "goals_against": self.goals_against,
            "own_goals": self.own_goals,
            "scored": interval(&self.scored),
            "goal_difference": interval(&self.difference),
            "time_to_ball_s": median(&self.to_ball),
            "time_to_goal_s": median(&self.to_goal),
            "detection": self.detection_as_json(),
            "belief": self.belief_as_json(),
            "stuck_s": self.stuck_s,
            "exposure_to_pwm_ms": samples_as_json(&self.exposure_to_pwm),
            "report_to_pwm_ms": samples_as_json(&self.report_to_pwm),
            "cpu_load_most": self.cpu_load_most,
            "sim_seconds": self.sim_seconds,
            "realtime_factor": self.factor,
        })
    }

    /// For people.
    pub fn print(&self) {
        let in_percent = |e: &Option<Estimate>| {
            e.map_or("-".to_owned(), |e| {
                let [value, low, high] = [e.value, e.low, e.high].map(|v| v * 100.0);
                format!("{value:.0} % (95 %: {low:.0} to {high:.0} %)")
            })
        };
        let difference = self.difference.map_or("-".to_owned(), |e| {
            format!("{:+.2} a match (95 %: {:+.2} to {:+.2})", e.value, e.low, e.high)
        });
        println!(
            "{} matches   {} : {}, of these {} own goals of ours",
            self.matches, self.goals_for, self.goals_against, self.own_goals
        );
        println!("scored in   {}", in_percent(&self.scored));
        println!("difference  {difference}");
        self.print_measured();
        println!(
            "twin        {:.0} s simulated, {:.1} times as fast as real time",
            self.sim_seconds, self.factor
        );
    }

    /// The part that a single match has, too.
    pub fn print_measured(&self) {
        let pair = |s: &Samples, share: f64| {
            format!("{} / {}", number(s.percentile(0.5)), number(s.percentile(share)))
        };
        let many = if self.matches > 1 { " (medians of those that came to it)" } else { "" };
        println!(
            "times       to the ball {} s, to the first goal {} s{many}; stuck {:.1} s a minute",
            number(median(&self.to_ball)),
            number(median(&self.to_goal)),
            self.stuck_s / self.sim_seconds * 60.0
        );
        let rate = |d: &Detection| number(d.rate().map(|rate| rate * 100.0));
        println!(
            "found       of what is visible: ball {} %, goal {} %, opponent {} %; wrong: ball {}, \
             goal {}, opponent {}",
            rate(&self.ball),
            rate(&self.goal),
            rate(&self.opponent),
            self.ball.wrong,
            self.goal.wrong,
            self.opponent.wrong
        );
        println!(
            "believed    while visible, median / 90 %: ball {} % and {} deg, goal {} %, opponent {} %",
            pair(&self.ball_errors.range_percent, 0.9),
            pair(&self.ball_errors.bearing_deg, 0.9),
            pair(&self.goal_errors.range_percent, 0.9),
            pair(&self.opponent_errors.range_percent, 0.9)
        );
        println!(
            "latency     median / 99 %: mid-exposure to PWM {} ms, report to PWM {} ms; 68331 at most \
             {:.0} % busy (approximate)",
            pair(&self.exposure_to_pwm, 0.99),
            pair(&self.report_to_pwm, 0.99),
            self.cpu_load_most * 100.0
        );
    }
}
