//! `sot stream`: both eyes to a file, and what is in such a file.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions};
use std::io::{BufReader, BufWriter, IsTerminal, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::{Subcommand, ValueEnum};
use common_sys::constants as c;
use common_sys::link::{Register, Report, registers, report_decode};
use common_sys::vision::EyeParams;
use image::RgbImage;
use serde_json::{Value, json};
use stream::{Checker, Damage, Findings, Frame, Parser, Place, Record, eye_name};
use turret_link::BulkReader;
use turret_link::eyes::{CameraState, StreamSettings};
use turret_link::turret::Turret;

use crate::fpga_reg::name_of;
use crate::interrupt::{self, Interrupted};
use crate::output::{Usage, write_picture};
use crate::robot_args::AskArgs;

/// Record what both eyes see, and look at what was recorded
#[derive(Subcommand)]
pub enum Command {
    Record(RecordArgs),
    Info(InfoArgs),
    Export(ExportArgs),
    Check(CheckArgs),
}

/// Size of the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Size {
    /// What soccer is played with
    #[value(name = "320x240")]
    Small,
    /// At most 30 frames a second
    #[value(name = "640x480")]
    Large,
}

/// Record the raw stream of both eyes
///
/// FILE gets the bytes as they come from USB, and FILE.index a line of JSON for each record; both are
/// written before anything is shown. Without --seconds and --pairs it records until Ctrl-C, which ends
/// the stream in order. A client that is too slow loses whole pairs, never parts of one; how many were
/// lost is counted here and in the turret, and the counts must agree, or the exit code is 1.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot stream record match.stream --seconds 10
  sot stream record large.stream --size 640x480 --pairs 100
  sot stream record speed.stream --pattern --seconds 5   needs the FPGA function `capture`
  sot stream check match.stream")]
pub struct RecordArgs {
    /// File to write; the index goes beside it, as FILE.index
    file: PathBuf,
    #[command(flatten)]
    on: AskArgs,
    /// End after so many seconds of the PC's clock
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// End after so many pairs
    #[arg(long, value_name = "N")]
    pairs: Option<u64>,
    /// Size of the frames
    #[arg(long, value_enum, default_value_t = Size::Small)]
    size: Size,
    /// Frames a second, 1 to 40 [default: as the FPGA has it]
    #[arg(long, value_name = "FPS", value_parser = clap::value_parser!(u16).range(1..=40))]
    rate: Option<u16>,
    /// The FPGA's test pattern instead of the cameras, as fast as USB takes it
    #[arg(long)]
    pattern: bool,
    /// Overwrite FILE
    #[arg(long)]
    force: bool,
}

/// Tell what a recording holds
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot stream info match.stream
  sot stream info match.stream --json")]
pub struct InfoArgs {
    /// A recording
    file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Write a recording's pairs as PNG, and its reports as lines of JSON
///
/// DIR gets NNNNNN_left.png and NNNNNN_right.png, numbered as the pairs are, and reports.jsonl with one
/// line a pair.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot stream export match.stream pictures
  sot stream export match.stream pictures --every 40     one pair a second
  sot detect pictures/000000_left.png pictures/000000_right.png")]
pub struct ExportArgs {
    /// A recording
    file: PathBuf,
    /// Folder, made if it is not there
    dir: PathBuf,
    /// Only each N-th pair
    #[arg(long, value_name = "N", default_value_t = 1,
          value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
}

/// Check a recording: gaps, order, and every report computed again
///
/// The detectors are run on the recorded pairs; each must give, bit for bit, the report that the FPGA
/// gave. With FILE.index beside it, every byte is compared with what was recorded. Pairs that were lost because the client was slow are told, but are no error as long as the
/// turret counted the same. Exit code 1 if anything is wrong.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  sot stream check match.stream
  sot stream check match.stream --json")]
pub struct CheckArgs {
    /// A recording
    file: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Run the verb.
pub fn run(command: &Command) -> Result<()> {
    match command {
        Command::Record(args) => record(args),
        Command::Info(args) => info(args),
        Command::Export(args) => export(args),
        Command::Check(args) => check(args),
    }
}

/// Bytes of a transfer, and how many are under way: half a millisecond each at full rate.
const TRANSFER: usize = 32 << 10;
const TRANSFERS: usize = 16;
/// The PC waits so long for bytes at a time ...
const PATIENCE: Duration = Duration::from_millis(100);
/// ... and in all, before it asks the cameras, and after the end was asked for.
const SILENCE: Duration = Duration::from_secs(3);
/// Between two looks at the screen.
const SHOW: Duration = Duration::from_millis(250);

/// What is written while a stream comes in.
struct Recorder {
    file: File,
    index: BufWriter<File>,
    parser: Parser,
    checker: Checker,
    started: Instant,
    bytes: u64,
    ended: bool,
    damage: Vec<String>,
}

impl Recorder {
    fn create(args: &RecordArgs) -> Result<Self> {
        let create = |path: &Path| -> Result<File> {
            let mut options = OpenOptions::new();
            options.write(true).create(true);
            if args.force {
                options.truncate(true)
            } else {
                options.create_new(true)
            };
            options.open(path).with_context(|| {
                format!("cannot write {}; --force overwrites an old recording", path.display())
            })
        };
        Ok(Self {
            file: create(&args.file)?,
            index: BufWriter::new(create(&index_of(&args.file))?),
            parser: Parser::default(),
            checker: Checker::of_headers(),
            started: Instant::now(),
            bytes: 0,
            ended: false,
            damage: Vec::new(),
        })
    }

    fn take(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.write_all(bytes).context("cannot write the recording")?;
        self.bytes += bytes.len() as u64;
        self.parser.push(bytes);
        loop {
            match self.parser.next_record() {
                Ok(Some((place, record))) => self.record(place, record)?,
                Ok(None) => return Ok(()),
                Err(damage) => self.damage.push(damage.to_string()),
            }
        }
    }

    fn record(&mut self, place: Place, record: Record) -> Result<()> {
        let host_ms = self.started.elapsed().as_millis() as u64;
        let line = index_line(place, &record, Some(host_ms));
        writeln!(self.index, "{line}").context("cannot write the index")?;
        self.ended |= matches!(record, Record::End(_));
        self.checker.take(record);
        Ok(())
    }

    fn show(&self) {
        let found = self.checker.findings();
        let seconds = self.started.elapsed().as_secs_f64().max(1e-3);
        eprint!(
            "\r{seconds:.1} s  {} pairs  {:.1} a second  {:.1} MB/s  {} lost ",
            found.pairs,
            found.pairs as f64 / seconds,
            self.bytes as f64 / 1e6 / seconds,
            found.lost
        );
    }
}

/// The index of a recording.
fn index_of(file: &Path) -> PathBuf {
    let mut name = file.as_os_str().to_owned();
    name.push(".index");
    name.into()
}

fn index_line(place: Place, record: &Record, host_ms: Option<u64>) -> Value {
    let header = record.header();
    let end = matches!(record, Record::End(_));
    json!({
        "at": place.at,
        "bytes": place.bytes,
        "crc32": place.crc32,
        "kind": if end { "end" } else { "frame" },
        "session": header.session,
        "number": header.number,
        "eye": if end { Value::Null } else { json!(eye_name(header.eye)) },
        "width": header.width_px,
        "height": header.height_px,
        "exposure_us": header.exposure_us,
        "sent": header.sent,
        "lost": header.lost,
        "host_ms": host_ms,
    })
}

fn record(args: &RecordArgs) -> Result<()> {
    if args.seconds.is_some_and(|seconds| !(seconds > 0.0 && seconds < 1e6)) {
        return Err(Usage("--seconds must be above 0 and below 1000000".into()).into());
    }
    let stop = interrupt::watch();
    let mut turret = args.on.robot.turret()?;
    turret.config_settled()?;
    let settings =
        StreamSettings { large: args.size == Size::Large, pattern: args.pattern, rate: args.rate };
    turret.stream_open(&settings)?;
    if !args.pattern {
        good_cameras(turret.camera_codes()?)?;
    }
    let mut recorder = Recorder::create(args)?;
    let streamed = stream_into(args, &mut turret, &mut recorder, stop);
    // Whatever went wrong, what was recorded stays, and the turret is left as it was.
    let written = recorder.index.flush().context("cannot write the index");
    if recorder.started.elapsed() > SHOW && std::io::stderr().is_terminal() {
        eprintln!();
    }
    let closed = turret.stream_close();
    streamed?;
    written?;
    closed?;
    verdict(args, recorder)?;
    if stop.load(Ordering::Relaxed) { Err(Interrupted.into()) } else { Ok(()) }
}

/// An error that names the camera, if one cannot work.
fn good_cameras(states: [CameraState; 2]) -> Result<()> {
    for (name, state) in ["left", "right"].into_iter().zip(states) {
        if state != CameraState::Ok {
            bail!("the {name} camera {state}");
        }
    }
    Ok(())
}

fn stream_into(
    args: &RecordArgs,
    turret: &mut Turret,
    recorder: &mut Recorder,
    stop: &AtomicBool,
) -> Result<()> {
    let show = std::io::stderr().is_terminal();
    let mut reader = BulkReader::start(turret.device(), c::USB_BULK_IN as u8, TRANSFER, TRANSFERS)?;
    Turret::stream_on(reader.device())?;
    recorder.started = Instant::now();
    let mut shown = Instant::now();
    let mut heard = Instant::now();
    let mut ending = false;
    while !recorder.ended {
        if let Some(bytes) = reader.next(PATIENCE)? {
            recorder.take(&bytes)?;
            heard = Instant::now();
        } else if heard.elapsed() > SILENCE {
            drop(reader);
            return Err(silence(turret, ending));
        }
        let over = args.seconds.is_some_and(|s| recorder.started.elapsed().as_secs_f64() >= s)
            || args.pairs.is_some_and(|n| recorder.checker.findings().pairs >= n)
            || stop.load(Ordering::Relaxed);
        if over && !ending {
            ending = true;
            heard = Instant::now();
            Turret::stream_end(reader.device())?;
        }
        if show && shown.elapsed() > SHOW {
            shown = Instant::now();
            recorder.show();
        }
    }
    Ok(())
}

/// Why nothing comes.
fn silence(turret: &mut Turret, ending: bool) -> anyhow::Error {
    let seconds = SILENCE.as_secs();
    if ending {
        return anyhow::anyhow!("the turret did not end the stream within {seconds} s");
    }
    match turret.cameras().map(good_cameras) {
        Ok(Err(camera)) => camera.context(format!("no frame came for {seconds} s")),
        Ok(Ok(())) => anyhow::anyhow!("no frame came for {seconds} s, though both cameras send"),
        Err(error) => anyhow::Error::from(error).context(format!("no frame came for {seconds} s")),
    }
}

fn verdict(args: &RecordArgs, recorder: Recorder) -> Result<()> {
    let seconds = recorder.started.elapsed().as_secs_f64();
    let Recorder { checker, bytes, mut damage, parser, .. } = recorder;
    damage.extend(parser.finish().err().map(|rest| rest.to_string()));
    let found = checker.finish();
    let good = damage.is_empty() && found.counts_differ == 0 && found.disorder == 0;
    if args.on.json {
        let [number, sent, lost] = found.end.unwrap_or_default();
        println!(
            "{}",
            json!({
                "file": args.file, "seconds": seconds, "bytes": bytes,
                "mb_per_s": bytes as f64 / 1e6 / seconds,
                "pairs": found.pairs, "pairs_per_s": found.pairs as f64 / seconds,
                "lost": found.lost, "torn": found.torn,
                "turret": { "pairs": number, "sent": sent, "lost": lost },
                "counts_agree": found.counts_differ == 0 && found.end.is_some(),
                "problems": damage.iter().chain(&found.problems).collect::<Vec<_>>(),
            })
        );
    } else {
        println!(
            "{}: {} pairs in {seconds:.1} s, {:.1} a second, {:.1} MB/s, {} lost (the turret says {})",
            args.file.display(),
            found.pairs,
            found.pairs as f64 / seconds,
            bytes as f64 / 1e6 / seconds,
            found.lost,
            found.end.map_or_else(|| "nothing".into(), |end| end[2].to_string())
        );
        damage.iter().chain(&found.problems).for_each(|problem| eprintln!("{problem}"));
    }
    if !good {
        bail!("the recording is not what the turret has sent; `sot stream check` tells where");
    }
    if found.torn > 0 {
        bail!("{} pairs were torn by a camera; `sot camera probe` tells which", found.torn);
    }
    Ok(())
}

/// Calls `each` with every record of a recording; returns what of it is damaged.
fn for_each(path: &Path, mut each: impl FnMut(Place, Record) -> Result<()>) -> Result<Vec<Damage>> {
    let opened = File::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut file = BufReader::new(opened);
    let mut parser = Parser::default();
    let mut damage = Vec::new();
    let mut piece = vec![0; 1 << 20];
    loop {
        let count =
            file.read(&mut piece).with_context(|| format!("cannot read {}", path.display()))?;
        parser.push(&piece[..count]);
        loop {
            match parser.next_record() {
                Ok(Some((place, record))) => each(place, record)?,
                Ok(None) => break,
                Err(found) => damage.push(found),
            }
        }
        if count == 0 {
            damage.extend(parser.finish().err());
            return Ok(damage);
        }
    }
}

/// A file without a single record is no recording.
fn some_records(path: &Path, records: u64, damage: &[Damage]) -> Result<()> {
    match (records, damage.first()) {
        (0, Some(first)) => bail!("{} is no recording of a stream: {first}", path.display()),
        (0, None) => bail!("{} is empty: nothing was recorded", path.display()),
        _ => Ok(()),
    }
}

fn info(args: &InfoArgs) -> Result<()> {
    let mut checker = Checker::of_headers();
    let mut sizes: Vec<(u16, u16)> = Vec::new();
    let (mut records, mut bytes, mut reports) = (0_u64, 0_u64, 0_u64);
    let mut times: Option<(u32, u32)> = None;
    // From which pair on the reports were made with which parameters.
    let mut params: Vec<(u32, EyeParams)> = Vec::new();
    let damage = for_each(&args.file, |place, record| {
        records += 1;
        bytes += place.bytes as u64;
        if let Record::Frame(frame) = &record {
            let size = (frame.header.width_px, frame.header.height_px);
            if !sizes.contains(&size) {
                sizes.push(size);
            }
            reports += u64::from(frame.has(c::STREAM_FLAG_REPORT) && frame.header.eye == 1);
            let made = frame.header.params;
            if frame.has(c::STREAM_FLAG_REPORT) && params.last().is_none_or(|last| last.1 != made) {
                params.push((frame.header.number, made));
            }
            let time = frame.header.exposure_us;
            times = Some((times.map_or(time, |(first, _)| first), time));
        }
        checker.take(record);
        Ok(())
    })?;
    some_records(&args.file, records, &damage)?;
    let found = checker.finish();
    let seconds = times.map_or(0.0, |(first, last)| f64::from(last.wrapping_sub(first)) / 1e6);
    let index = index_of(&args.file).exists();
    if args.json {
        println!(
            "{}",
            json!({
                "file": args.file, "bytes": bytes, "streams": found.sessions,
                "sizes": sizes.iter().map(|(w, h)| format!("{w}x{h}")).collect::<Vec<_>>(),
                "pairs": found.pairs, "lost": found.lost, "reports": reports, "torn": found.torn,
                "exposure_unsettled": found.unsettled,
                "seconds": seconds, "ended": found.unended == 0, "index": index,
                "registers": params.iter().map(|(from, params)| {
                    json!({ "from_pair": from, "values": params_as_json(params) })
                }).collect::<Vec<_>>(),
                "problems": words(&damage, &found),
            })
        );
        return Ok(());
    }
    let sizes: Vec<String> = sizes.iter().map(|(w, h)| format!("{w}x{h}")).collect();
    println!("pairs      {} of {}", found.pairs, sizes.join(" and "));
    println!("lost       {}", found.lost);
    println!("reports    {reports}");
    if found.unsettled > 0 {
        println!("exposure   unsettled in {} pairs", found.unsettled);
    }
    for (from, params) in &params {
        println!("registers  from pair {from} on: {}", unusual_params(params));
    }
    println!("exposed    within {seconds:.3} s");
    println!("bytes      {bytes}");
    println!("streams    {}{}", found.sessions, if found.unended > 0 { ", cut off" } else { "" });
    println!("index      {}", if index { "there" } else { "missing, and not needed" });
    words(&damage, &found).iter().for_each(|problem| println!("problem    {problem}"));
    Ok(())
}

fn words(damage: &[Damage], found: &Findings) -> Vec<String> {
    damage.iter().map(ToString::to_string).chain(found.problems.iter().cloned()).collect()
}

/// Where each record begins and its CRC-32, as the index has them; nothing without an index.
fn check_sums(file: &Path) -> Result<HashMap<u64, u32>> {
    let path = index_of(file);
    if !path.exists() {
        return Ok(HashMap::new());
    }
    let text =
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut sums = HashMap::new();
    for (number, line) in text.lines().enumerate() {
        let entry: Option<(u64, u32)> = serde_json::from_str(line).ok().and_then(|line: Value| {
            Some((line["at"].as_u64()?, u32::try_from(line["crc32"].as_u64()?).ok()?))
        });
        let Some((at, sum)) = entry else {
            bail!(
                "{}: line {} is no entry of an index; without the file the recording is checked \
                 all the same",
                path.display(),
                number + 1
            );
        };
        sums.insert(at, sum);
    }
    Ok(sums)
}

fn check(args: &CheckArgs) -> Result<()> {
    let mut checker = Checker::default();
    let mut records = 0;
    let sums = check_sums(&args.file)?;
    let mut altered = Vec::new();
    let damage = for_each(&args.file, |place, record| {
        records += 1;
        if sums.get(&place.at).is_some_and(|sum| *sum != place.crc32) {
            let (number, eye) = (record.header().number, eye_name(record.header().eye));
            altered.push(format!(
                "pair {number}, {eye} eye: changed since it was recorded (CRC-32 of the index)"
            ));
        }
        checker.take(record);
        Ok(())
    })?;
    some_records(&args.file, records, &damage)?;
    let found = checker.finish();
    let good = found.all_right() && damage.is_empty() && altered.is_empty();
    let problems = [altered.clone(), words(&damage, &found)].concat();
    if args.json {
        println!(
            "{}",
            json!({
                "file": args.file, "ok": good, "pairs": found.pairs, "lost": found.lost,
                "gaps": found.lost, "out_of_order": found.disorder,
                "counts_agree": found.counts_differ == 0 && found.unended == 0,
                "ended": found.unended == 0, "damaged": damage.len(), "torn": found.torn,
                "reports_checked": found.reports, "reports_different": found.reports_differ,
                "pattern_wrong": found.pattern_wrong, "altered": altered.len(),
                "problems": problems,
            })
        );
    } else {
        println!(
            "{} pairs, {} lost, {} out of order, {} damaged places",
            found.pairs,
            found.lost,
            found.disorder,
            damage.len()
        );
        println!("{} reports computed again, {} differ", found.reports, found.reports_differ);
        problems.iter().for_each(|problem| println!("{problem}"));
    }
    if !good {
        bail!("{}: not all is right with this recording", args.file.display());
    }
    Ok(())
}

fn export(args: &ExportArgs) -> Result<()> {
    fs::create_dir_all(&args.dir)
        .with_context(|| format!("cannot make the folder {}", args.dir.display()))?;
    let path = args.dir.join("reports.jsonl");
    let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut lines = BufWriter::new(file);
    let (mut records, mut pairs, mut sessions) = (0_u64, 0_u64, Vec::new());
    let mut left: Option<Frame> = None;
    let damage = for_each(&args.file, |_, record| {
        records += 1;
        let Record::Frame(frame) = record else { return Ok(()) };
        if u32::from(frame.header.eye) == c::STREAM_EYE_LEFT {
            left = Some(frame);
            return Ok(());
        }
        let pair = left.take().filter(|left| {
            (left.header.session, left.header.number) == (frame.header.session, frame.header.number)
        });
        let Some(left) = pair else { return Ok(()) };
        if !frame.header.number.is_multiple_of(args.every) {
            return Ok(());
        }
        if !sessions.contains(&frame.header.session) {
            sessions.push(frame.header.session);
        }
        // Of several streams in one file each but the first has its number before the pair's.
        let stem = match sessions.len() {
            1 => format!("{:06}", frame.header.number),
            more => format!("{more}_{:06}", frame.header.number),
        };
        for eye in [&left, &frame] {
            write_picture(&args.dir.join(format!("{stem}_{}.png", eye.eye())), picture(eye))?;
        }
        writeln!(lines, "{}", report_line(&stem, &frame))
            .with_context(|| format!("cannot write {}", path.display()))?;
        pairs += 1;
        Ok(())
    })?;
    some_records(&args.file, records, &damage)?;
    lines.flush().with_context(|| format!("cannot write {}", path.display()))?;
    eprintln!("{}: {pairs} pairs", args.dir.display());
    if let Some(first) = damage.first() {
        bail!("{} is damaged, what is whole was written: {first}", args.file.display());
    }
    Ok(())
}

/// A frame as a picture of 8 bits a channel.
fn picture(frame: &Frame) -> RgbImage {
    let (width, height) = (u32::from(frame.header.width_px), u32::from(frame.header.height_px));
    RgbImage::from_fn(width, height, |x, y| {
        let pixel = u32::from(frame.pixels[(y * width + x) as usize]);
        // The highest bits again as the lowest, so that white is white.
        let [r, g, b] = [pixel >> 11 & 0x1F, pixel >> 5 & 0x3F, pixel & 0x1F];
        image::Rgb([r << 3 | r >> 2, g << 2 | g >> 4, b << 3 | b >> 2].map(|channel| channel as u8))
    })
}

fn report_line(stem: &str, frame: &Frame) -> Value {
    let header = &frame.header;
    let report = match report_decode(&header.report) {
        Some(report) if frame.has(c::STREAM_FLAG_REPORT) => report_as_json(&report),
        _ => Value::Null,
    };
    json!({
        "pair": stem, "number": header.number, "exposure_us": header.exposure_us,
        "torn": frame.has(c::STREAM_FLAG_TORN),
        "registers": params_as_json(&header.params),
        "report": report,
    })
}

/// The detectors' parameters by their names.
fn params_as_json(params: &EyeParams) -> Value {
    named_params(params).map(|(register, value)| (name_of(register), json!(value))).collect()
}

fn named_params(params: &EyeParams) -> impl Iterator<Item = (&'static Register, u8)> {
    registers().iter().filter(|register| register.is_param).zip(params.to_bytes())
}

/// Those that are not as after configuration, in words.
fn unusual_params(params: &EyeParams) -> String {
    let unusual = named_params(params)
        .filter(|(register, value)| register.reset != u16::from(*value))
        .map(|(register, value)| format!("{} {value}", name_of(register)));
    let words: Vec<String> = unusual.collect();
    if words.is_empty() { "as after configuration".into() } else { words.join(", ") }
}

/// A report in its own units, pixels of 320x240 with fractions.
fn report_as_json(report: &Report) -> Value {
    let has = |flag: u32| u32::from(report.flags) & flag != 0;
    let px = |q4: u16| f64::from(q4) / 16.0;
    // 0 stands for none.
    let disparity = |q4: u16| (q4 != 0).then(|| px(q4));
    let ball = has(c::REPORT_BALL).then(|| {
        json!({
            "x": px(report.ball_x_q4), "row": report.ball_row, "width": report.ball_width_px,
            "disparity": disparity(report.ball_disparity_q4), "clipped": has(c::REPORT_BALL_CLIPPED),
            "right_only": has(c::REPORT_BALL_RIGHT_ONLY), "left_only": has(c::REPORT_BALL_LEFT_ONLY),
            "confidence": report.ball_confidence,
        })
    });
    let edge = |side: usize, flag: u32| {
        has(flag).then(|| {
            json!({ "x": px(report.goal_x_q4[side]), "disparity": disparity(report.goal_disparity_q4[side]) })
        })
    };
    let opponent = has(c::REPORT_OPPONENT).then(|| {
        json!({
            "x": px(report.opponent_x_q4), "disparity": disparity(report.opponent_disparity_q4),
            "confidence": report.opponent_confidence,
        })
    });
    json!({
        "sequence": report.sequence, "flags": report.flags,
        "ball": ball,
        "goal_left": edge(0, c::REPORT_GOAL_LEFT_EDGE),
        "goal_right": edge(1, c::REPORT_GOAL_RIGHT_EDGE),
        "goal_confidence": report.goal_confidence,
        "opponent": opponent, "wall": report.wall_row,
    })
}
