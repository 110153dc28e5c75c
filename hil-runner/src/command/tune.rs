//! `hil-runner tune`: the setting of some keys that serves a case best.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, bail};
use clap::Args;
use hil_core::case::Case;
use hil_core::error::RunError;
use hil_core::number;
use hil_core::report::compared;
use hil_core::run::{CaseRun, RunOptions};
use hil_core::runfile::tune_settings::TuneSettings;
use hil_core::runfile::{RunFile, Template, with_sets};
use hil_core::tune::corners;
use hil_core::tune::outcome::{self, TuneOutcome};
use hil_core::tune::prepare::{NeededKey, Prepared, prepare};
use hil_core::tune::problem::{NEARLY, Problem, with_controller_of};
use hil_core::tune::search::{Found, fewest_runs, idle, probes, search};
use hil_runner::files::{self, OutputFile};
use hil_runner::host::Team;
use hil_runner::live::{Live, LiveCase};
use hil_runner::report::tune::render_tune;
use hil_runner::report::{command_line, each_with};

mod settings_file;
mod tables;

use self::settings_file::{SettingsError, SettingsFile};
use super::options::{Sets, live_if};
use super::terminal::{self, check_signals, tell, watch_signals};

/// Runs that a search may make for one axis, and for each of several.
const RUNS: u64 = 10_000;
const RUNS_A_CORNER: u64 = 3_000;

/// Axes drawn from the tolerance, and runs of them between two looks at the clock.
const AXES: u64 = 1_000;
const A_TURN: usize = 256;

/// Progress in runs.
const BAR: &str = "{prefix}: {bar:30} {human_pos} of {human_len} runs, {eta} left";

/// Search the setting of some keys that serves best
#[derive(Debug, Args)]
#[command(after_help = include_str!("help/tune.txt").trim_ascii_end())]
pub(crate) struct Tune {
    /// Run file or built-in case
    case: String,
    /// File with [tune], instead of the one in the run file
    #[arg(long, value_name = "F.toml")]
    tune: Option<PathBuf>,
    #[command(flatten)]
    sets: Sets,
    /// Folder of the results [default: out/tune-NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads that compute, at most 1024 [default: one for each core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print what tune.json has, in place of the tables
    #[arg(long)]
    json: bool,
    /// Carry the simulator in the page: a click on a setting of the front opens it
    #[arg(long)]
    live: bool,
}

/// What a tune is made of, as it was read.
struct Input {
    /// Text of the run file, and of the file with [tune] where it has one of its own.
    text: String,
    of_tune: Option<String>,
    /// Overrides of the case.
    sets: Vec<String>,
    template: Template,
    settings: TuneSettings,
}

impl Tune {
    pub(crate) fn execute(&self) -> anyhow::Result<bool> {
        let input = self.input()?;
        let mut prepared = prepare(&input.template, &input.settings)?;
        let runs = runs(&input.settings, &prepared.problem)?;
        let folder = self.folder(&input.template.base().name)?;
        let live = live_if(self.live, || {
            let sets = input.sets.iter().filter(|set| !is_of_tune(set)).cloned();
            let sets: Vec<String> = sets.collect();
            Ok(LiveCase::new(&self.case, &input.text, &sets)?)
        })?;
        let profile = profile_beside(&self.case, &input.text, &folder)?;
        prepared.needed.extend(profile);
        let mut known = SettingsFile::open(&folder, &self.origin(&input), &prepared.problem)?;
        let (place, read) = (folder.display(), known.read());
        if read > 0 {
            tell!("{place}: {read} settings are there already\n");
        }
        let given = self.threads.and_then(|n| NonZeroUsize::new(n.into()));
        let cores = || std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        let team = Team::new(given.unwrap_or_else(cores))?;
        let begun = Instant::now();
        let budget = [runs, input.settings.seed];
        let found = self.search(&mut prepared, budget, &mut known, &team);
        if let Err(error) = &found
            && read == 0
            && !error.is::<SettingsError>()
        {
            // What was refused must not stand in the way of what is asked for better.
            known.remove()?;
        }
        let found = found?.with_context(|| {
            let command = self.command_line();
            format!("interrupted: every setting looked at is in {place}; to go on: {command}")
        })?;
        let tolerance = || tolerance(&input, &prepared, &found, &team);
        let tolerance = found.best.is_feasible().then(tolerance).transpose()?;
        let outcome = TuneOutcome::new(&prepared, &found, input.settings.seed, tolerance);
        let of_yield = outcome.tolerance.as_ref().map_or(0, |of| 2 * of.axes);
        let looked = begun.elapsed().as_secs_f64();
        let (settings, runs) = (outcome.settings, outcome.runs);
        tell!("{settings} settings, {runs} runs and {of_yield} for the yield in {looked:.1} s\n");
        let path = |name: &str| folder.join(name);
        OutputFile::create(&path("tune.json"))?.write_json(&outcome)?;
        let told = (&found, &outcome);
        let run = self.write_file(&path("tuned.toml"), &input, &prepared, told)?;
        let sentences = self.write_page(&path("report.html"), &prepared, told, live)?;
        match self.json {
            true => terminal::print_json(&outcome)?,
            false => terminal::print(&(tables::tables(&outcome, &sentences) + &run))?,
        }
        Ok(outcome.feasible)
    }

    /// Reads the case and what is asked for: in the run file, or in a file of its own.
    fn input(&self) -> anyhow::Result<Input> {
        let sets = self.sets.sets.iter().cloned();
        let (of_tune, of_case): (Vec<String>, Vec<String>) = sets.partition(|set| is_of_tune(set));
        let sets = match self.tune {
            Some(_) => of_case,
            None => self.sets.sets.clone(),
        };
        let text = files::text(&self.case)?;
        let file = RunFile::parse(&self.case, &text, &sets, files::profile)?;
        let read = |path: &PathBuf| -> anyhow::Result<(String, String)> {
            let name = path.to_string_lossy().into_owned();
            let text = files::text(&name)?.into_owned();
            Ok((name, text))
        };
        let tune = self.tune.as_ref().map(read).transpose()?;
        let settings = match (&tune, &file.tune) {
            (Some((name, text)), _) => file.tune_of(name, text, &of_tune)?,
            (None, Some(settings)) => settings.clone(),
            (None, None) => bail!(
                "{} has no [tune]: write one with keys = [\"controller.kp\", …] into it, or give --tune FILE",
                self.case
            ),
        };
        Ok(Input {
            template: Template::parse(&self.case, &text, &sets, files::profile)?,
            text: text.into_owned(),
            of_tune: tune.map(|(_, text)| text),
            sets,
            settings,
        })
    }

    /// The folder of the results, in which the run file itself is not.
    fn folder(&self, name: &str) -> anyhow::Result<PathBuf> {
        let name = name.replace(['/', '\\'], "_");
        let usual = || Path::new("out").join(format!("tune-{name}"));
        let folder = self.out.clone().unwrap_or_else(usual);
        let path = folder.join("tuned.toml");
        if files::same_file(&path, Path::new(&self.case)) {
            let path = path.display();
            bail!("{path} would be overwritten: give another --out");
        }
        Ok(folder)
    }

    /// Writes the run file with what was found; the command that runs it. Without a setting
    /// that keeps all requirements, none, and that of an earlier tune goes.
    fn write_file(
        &self,
        path: &Path,
        input: &Input,
        prepared: &Prepared,
        (found, outcome): (&Found, &TuneOutcome),
    ) -> anyhow::Result<String> {
        if !outcome.feasible {
            if path.exists() {
                std::fs::remove_file(path).with_context(|| path.display().to_string())?;
            }
            return Ok(String::new());
        }
        let tuned = tuned_text(&input.text, prepared, found)?;
        let sets = sets_beside(&input.sets, outcome);
        let place = path.to_string_lossy();
        // What is written is what was found.
        RunFile::parse(&place, &tuned, &sets, files::profile)?;
        OutputFile::create(path)?.write_whole(&tuned)?;
        let words = ["run", &place].into_iter();
        let command = command_line(words.chain(each_with("--set", &sets)));
        Ok(command + "\n")
    }

    /// Writes the page, before and after over each other; the sentences that it has, for the
    /// terminal.
    fn write_page(
        &self,
        path: &Path,
        prepared: &Prepared,
        (found, outcome): (&Found, &TuneOutcome),
        live: Option<Live>,
    ) -> anyhow::Result<Vec<String>> {
        let runs = both_runs(prepared, found)?;
        let mut sentences = tables::sentences(outcome);
        if outcome.feasible {
            sentences.extend(broken_budget(&runs[1]));
        }
        let title = format!("{}, tuned", outcome.name);
        let report = compared(&title, &self.command_line(), &runs);
        let html = render_tune(&report, outcome, &sentences, live.as_ref())?;
        OutputFile::create(path)?.write_whole(&html)?;
        tell!("{}\n", path.display());
        Ok(sentences)
    }

    /// What makes a tune another one: the texts of the files, the overrides, the program.
    fn origin(&self, input: &Input) -> String {
        let version = env!("CARGO_PKG_VERSION");
        let (case, tune) = (input.template.base(), &input.of_tune);
        // The command over time stands for a profile, which is a file of its own.
        let at = |k: u64| {
            let time_ns = case.run.duration_ns / 1_000 * k;
            case.motion.at(number::seconds(time_ns)).displacement_m
        };
        let motion: Vec<f64> = (0..=1_000).map(at).collect();
        let (text, sets) = (&input.text, &self.sets.sets);
        let all = format!("{text}\n{tune:?}\n{sets:?}\n{motion:?}");
        let sum = files::crc64(all.as_bytes());
        let case = &self.case;
        format!("hil-runner {version} tune of {case}, inputs {sum}")
    }

    /// Searches; nothing if the user has ended it.
    fn search(
        &self,
        prepared: &mut Prepared,
        budget: [u64; 2],
        known: &mut SettingsFile,
        team: &Team,
    ) -> anyhow::Result<Option<Found>> {
        watch_signals("ending after the runs under way; nothing is lost\n");
        let bar = terminal::bar("tune", budget[0], BAR);
        let starts = prepared.starts.iter();
        let starts: Vec<Vec<f64>> = starts.filter_map(|row| row.with.clone().ok()).collect();
        let problem = &mut prepared.problem;
        let mut runner = |cases: &[Case]| team.figures(cases);
        let before = problem.run_before(&mut runner);
        before.map_err(anyhow::Error::msg)?;
        let mut look = |problem: &mut Problem, settings: Vec<Vec<f64>>, most: f64| {
            check_signals()?;
            let seen = known.look(problem, settings, |problem, settings| {
                problem.look(settings, most, &mut runner)
            })?;
            bar.inc(seen.iter().map(|seen| seen.runs).sum());
            anyhow::Ok(seen)
        };
        let made = (|| {
            // Starts are shown, whatever margins they have.
            let first = look(problem, starts, f64::INFINITY)?;
            let asked = probes(problem, &first);
            let probed = look(problem, asked, NEARLY)?;
            if let Some(sentence) = idle(problem, &first, &probed) {
                bail!(sentence);
            }
            let own = first.first().context("the file's own setting is a start")?;
            search(problem, (own.clone(), first), budget, &mut look)
        })();
        bar.finish_and_clear();
        match made {
            Err(_) if check_signals().is_err() => Ok(None),
            made => made.map(Some),
        }
    }

    fn command_line(&self) -> String {
        let paths = [&self.tune, &self.out];
        let [tune, out] = paths.map(|path| path.as_deref().map(Path::to_string_lossy));
        let words = ["tune", &self.case].into_iter();
        let words = words
            .chain(each_with("--tune", &tune))
            .chain(each_with("--set", &self.sets.sets));
        command_line(words.chain(each_with("--out", &out)))
    }
}

/// The key of an override.
fn path_of(set: &str) -> &str {
    set.split('=').next().unwrap_or_default().trim()
}

/// True for an override of [tune].
fn is_of_tune(set: &str) -> bool {
    let path = path_of(set);
    path == "tune" || path.starts_with("tune.")
}

/// Runs that a search may make.
///
/// # Errors
/// They are too few to begin with.
fn runs(settings: &TuneSettings, problem: &Problem) -> anyhow::Result<u64> {
    let axes = problem.corners.len() as u64;
    let usual = if axes > 1 { RUNS_A_CORNER * axes } else { RUNS };
    let (runs, fewest) = (settings.runs.unwrap_or(usual), fewest_runs(problem));
    if runs < fewest {
        let of = |number: u64, one: &str, many: &str| {
            format!("{number} {}", if number == 1 { one } else { many })
        };
        bail!(
            "tune.runs = {runs} is not allowed: a search over {} and {} needs at least {fewest}",
            of(problem.variables.len() as u64, "key", "keys"),
            of(axes, "axis", "axes")
        );
    }
    Ok(runs)
}

/// The yield on axes drawn from their tolerance.
fn tolerance(
    input: &Input,
    prepared: &Prepared,
    found: &Found,
    team: &Team,
) -> anyhow::Result<outcome::Tolerance> {
    let (problem, settings) = (&prepared.problem, &input.settings);
    let axes = corners::tolerance(&problem.template, &settings.over, AXES, settings.seed);
    let (axes, drawn) = axes.map_err(anyhow::Error::msg)?;
    let tuned = [&found.own, &found.best].map(|seen| problem.tuned(&seen.values));
    let [Some(before), Some(after)] = &tuned else {
        bail!("the setting that was found makes no run");
    };
    // Both side by side: they have the tables of their axis in common.
    let cases: Vec<Case> = axes
        .iter()
        .flat_map(|axis| [before, after].map(|tuned| with_controller_of(&axis.case, tuned)))
        .collect();
    let bar = terminal::bar("yield", cases.len() as u64, BAR);
    let mut made = Vec::with_capacity(cases.len());
    for some in cases.chunks(A_TURN) {
        check_signals()?;
        made.extend(team.figures(some));
        bar.inc(some.len() as u64);
    }
    bar.finish_and_clear();
    let runs = [0, 1].map(|first| made.iter().skip(first).step_by(2).collect());
    Ok(outcome::tolerance(
        problem,
        input.template.base(),
        drawn,
        runs,
    ))
}

/// The runs of the file's own setting and of the best one.
fn both_runs(prepared: &Prepared, found: &Found) -> anyhow::Result<[CaseRun; 2]> {
    let own = prepared.problem.template.base();
    let best = prepared.problem.tuned(&found.best.values);
    let best = best.map_or_else(|| own.clone(), |best| with_controller_of(own, &best));
    let options = RunOptions {
        plot: true,
        ..RunOptions::default()
    };
    let run = |case: &Case| -> Result<CaseRun, RunError> {
        let mut run = CaseRun::new(case, options, &mut |_| Ok(()))?;
        run.confirm(options, &mut |_| Ok(()))?;
        Ok(run)
    };
    Ok([run(own)?, run(&best)?])
}

/// The sentence about limits of the budget that a tune was not asked to keep.
fn broken_budget(run: &CaseRun) -> Option<String> {
    let verdicts = &run.outcome.summary.verdicts;
    let broken = verdicts.iter().filter(|verdict| !verdict.pass);
    let broken: Vec<&str> = broken.map(|verdict| verdict.figure).collect();
    let words = "tuned.toml breaks the budget, of which no requirement was made";
    (!broken.is_empty()).then(|| format!("{words}: {}", broken.join(", ")))
}

/// The overrides that the tuned file leaves in force: those of [tune] and of the keys that it
/// has are no longer.
fn sets_beside(sets: &[String], outcome: &TuneOutcome) -> Vec<String> {
    let tuned = outcome.keys.iter().map(|row| &row.key);
    let tuned = tuned.chain(outcome.needed.iter().map(|row| &row.key));
    let is_tuned = |set: &str| tuned.clone().any(|key| key == path_of(set));
    let beside = sets.iter().filter(|set| !is_of_tune(set) && !is_tuned(set));
    beside.cloned().collect()
}

/// The profile of a run file, if it has one, as the file in another folder has to name it.
fn profile_beside(case: &str, text: &str, folder: &Path) -> anyhow::Result<Option<NeededKey>> {
    let file: toml_edit::DocumentMut = text.parse()?;
    let profile = file.get("motion").and_then(|motion| motion.get("profile"));
    let Some(profile) = profile.and_then(toml_edit::Item::as_str) else {
        return Ok(None);
    };
    let beside = Path::new(case).parent().unwrap_or(Path::new(""));
    let absolute = std::path::absolute(beside.join(profile))?;
    if std::path::absolute(folder)?.join(profile) == absolute {
        return Ok(None);
    }
    let value = toml_edit::Value::from(absolute.to_string_lossy().as_ref());
    Ok(Some(NeededKey {
        key: "motion.profile".to_owned(),
        value: value.to_string(),
        because: "tuned.toml lies in another folder".to_owned(),
    }))
}

/// The run file with the tuned keys, and those that they need.
fn tuned_text(text: &str, prepared: &Prepared, found: &Found) -> anyhow::Result<String> {
    let needed = prepared.needed.iter();
    let needed = needed.map(|need| format!("{}={}", need.key, need.value));
    let changes = prepared.problem.changes(&found.best.values).into_iter();
    let changes = changes.map(|(key, value)| format!("{}={}", key.path(), value.to_toml()));
    let sets: Vec<String> = needed.chain(changes).collect();
    Ok(with_sets("tuned.toml", text, &sets)?)
}
