//! Makes a cell in continuous time from its settings.

use crate::design::file::{
    At, ContinuousPlantTable, ContinuousTable, FileError, Key, WaveName, WaveTable, operators, wrong,
};
use crate::design::{ContinuousCell, SettingsReader, Term, named};
use crate::text;
use asobench_identification::observer::gpebo::{CascadeError, GpeboOptions, ObserverSpec, Operator};
use asobench_identification::plant::ContinuousPlant;
use asobench_identification::signal::{Hold, Signal, Wave};

/// Built-in plants, which need no table.
pub(crate) const CONTINUOUS_PLANTS: [&str; 1] = ["bobtsov2023"];
/// Built-in disturbances, which need no table.
pub(crate) const SIGNALS: [&str; 6] = ["none", "constant", "ramp", "sine", "square", "white"];

/// The largest number of states of a plant. The cost of a step of the mixing grows as their fifth power.
const MOST_STATES: usize = 16;

/// The largest number of terms of a disturbance.
const MOST_TERMS: usize = 100;

/// The largest number of white noise samples in a trial.
const MOST_HOLDS: f64 = 1e7;

/// Makes the cell of some settings.
pub(crate) fn continuous_cell(
    build: &SettingsReader<'_>,
    table: &ContinuousTable,
) -> Result<ContinuousCell, FileError> {
    times(table)?;
    let (plant, x0, xi0) = plant(build)?;
    let n = plant.order();
    let filters = match &table.filters {
        Some(filters) => operators(filters),
        None => (1..n).map(|i| Operator::Lag(i as f64)).collect(),
    };
    let scale = positive(build, Key::GainScale)?;
    let step = positive(build, Key::Step)?;
    let tables = build.file.observers.iter().enumerate();
    let observers: Result<Vec<ObserverSpec>, FileError> = tables
        .map(|(i, table)| {
            let place = format!("observers[{i}] ({})", table.observer.name());
            let spec = table.observer.spec(&plant, &xi0, scale);
            spec.at(place)
        })
        .collect();
    let cell = ContinuousCell {
        input: Signal {
            waves: vec![Wave::Constant { value: table.input }],
        },
        disturbance: disturbance(build, table.until)?,
        gpebo: GpeboOptions { xi0, filters },
        observers: observers?,
        until: table.until,
        scored_from: table.scored_from,
        step,
        error_limit: table.error_limit,
        trace_every: table.trace_every,
        plant,
        x0,
    };
    cell.check(build.file.seed).map_err(placed)?;
    Ok(cell)
}

/// Returns an error with its place in the file.
fn placed(error: CascadeError) -> FileError {
    match error {
        CascadeError::Observer { number, mistake } => {
            FileError::key(format_args!("observers[{}]", number - 1), mistake)
        }
        CascadeError::Signal { source, .. } => FileError::key(Key::Disturbance, source),
        CascadeError::Setting(mistake) => FileError::key("continuous", mistake),
    }
}

/// Checks the times of the table.
fn times(table: &ContinuousTable) -> Result<(), FileError> {
    let positive = |x: f64| x > 0.0 && x.is_finite();
    let wrong = |key: &str, value: f64, expected: &str| {
        let message = format!("{}; expected {expected}", text::number(value));
        wrong(format_args!("continuous.{key}"), message)
    };
    if !positive(table.until) {
        return wrong("until", table.until, "a time above 0, in seconds");
    }
    if !(0.0..table.until).contains(&table.scored_from) {
        return wrong("scored_from", table.scored_from, "a time from 0 to less than 'until'");
    }
    if !positive(table.error_limit) {
        return wrong("error_limit", table.error_limit, "a relative error above 0");
    }
    if !table.input.is_finite() {
        return wrong("input", table.input, "a finite number");
    }
    match table.trace_every {
        Some(every) if !positive(every) => wrong("trace_every", every, "seconds above 0"),
        _ => Ok(()),
    }
}

/// Returns the plant, x(0) and xi(0).
fn plant(build: &SettingsReader<'_>) -> Result<(ContinuousPlant, Vec<f64>, Vec<f64>), FileError> {
    let name = build.text(Key::Plant);
    if name == "bobtsov2023" {
        return Ok((ContinuousPlant::bobtsov2023(), vec![1.0, 2.0], vec![0.0; 2]));
    }
    let tables = &build.file.continuous_plants;
    let table = named(Key::Plant, &name, &CONTINUOUS_PLANTS, tables)?;
    let ContinuousPlantTable { a, b, c, x0, xi0 } = table;
    let wrong = |message: String| FileError::key(format_args!("continuous_plants.{name}"), message);
    let plant = ContinuousPlant::new(a, b.clone(), c.clone()).map_err(|e| wrong(e.to_string()))?;
    let n = plant.order();
    if n > MOST_STATES {
        return Err(wrong(format!("{n} states; expected at most {MOST_STATES}")));
    }
    let xi0 = xi0.clone().unwrap_or_else(|| vec![0.0; n]);
    for (key, x) in [("x0", x0), ("xi0", &xi0)] {
        if x.len() != n || !x.iter().all(|x| x.is_finite()) {
            return Err(wrong(format!("{key}; expected {n} finite numbers, one per state")));
        }
    }
    Ok((plant, x0.clone(), xi0))
}

fn positive(build: &SettingsReader<'_>, key: Key) -> Result<f64, FileError> {
    let number = build.number(key)?;
    if number > 0.0 {
        return Ok(number);
    }
    wrong(key, format!("{}; expected a number above 0", text::number(number)))
}

/// Returns the terms of the disturbance. Random terms with amplitude zero are left out, so that nothing is drawn for
/// them.
fn disturbance(build: &SettingsReader<'_>, until: f64) -> Result<Vec<Term>, FileError> {
    let mut terms = terms(build, until)?;
    terms.retain(|term| match term {
        Term::Fixed(_) => true,
        Term::White { deviation, .. } => *deviation != 0.0,
        Term::RandomPhase(wave) => match wave {
            Wave::Sine { amplitude, .. } | Wave::Square { amplitude, .. } => *amplitude != 0.0,
            _ => true,
        },
    });
    Ok(terms)
}

/// Returns the terms as the settings ask for them.
fn terms(build: &SettingsReader<'_>, until: f64) -> Result<Vec<Term>, FileError> {
    let name = build.text(Key::Disturbance);
    match name.parse() {
        _ if name == "none" => return Ok(Vec::new()),
        Err(_) | Ok(WaveName::File) => {}
        Ok(wave) => {
            let table = WaveTable {
                wave,
                amplitude: 1.0,
                ..WaveTable::default()
            };
            return Ok(vec![term(build, &table, until, "settings")?]);
        }
    }
    let table = named(Key::Disturbance, &name, &SIGNALS, &build.file.signals)?;
    let place = |i: usize| format!("signals.{name}.waves[{i}]");
    if table.waves.len() > MOST_TERMS {
        let message = format!("{} waves; expected at most {MOST_TERMS}", table.waves.len());
        return wrong(format_args!("signals.{name}"), message);
    }
    let waves = table.waves.iter().enumerate();
    waves.map(|(i, wave)| term(build, wave, until, &place(i))).collect()
}

/// Returns one term, times the level.
fn term(build: &SettingsReader<'_>, table: &WaveTable, until: f64, place: &str) -> Result<Term, FileError> {
    let level = build.number(Key::Level)?;
    let amplitude = table.amplitude * level;
    let refused = |message: String| wrong(place, message);
    if !amplitude.is_finite() {
        return refused(format!("amplitude {}; expected a finite number", table.amplitude));
    }
    match table.wave {
        WaveName::Constant => Ok(Term::Fixed(Wave::Constant { value: amplitude })),
        WaveName::Ramp => Ok(Term::Fixed(Wave::Ramp { slope: amplitude })),
        WaveName::Sine | WaveName::Square => periodic(build, table, amplitude),
        WaveName::White => {
            let hold = positive(build, Key::NoiseHold)?;
            if until / hold > MOST_HOLDS {
                let hold = text::number(hold);
                let message = format!("{hold}; expected at most {MOST_HOLDS} holds in a trial");
                return wrong(Key::NoiseHold, message);
            }
            Ok(Term::White {
                deviation: amplitude.abs(),
                hold,
            })
        }
        WaveName::File => {
            let (Some(interval), Some(values)) = (table.interval, &table.values) else {
                return refused("expected file = \"NAME.csv\" beside wave = \"file\"".to_owned());
            };
            Ok(Term::Fixed(Wave::Samples {
                interval,
                values: values.iter().map(|value| value * amplitude).collect(),
                hold: Hold::from(table.hold),
            }))
        }
    }
}

/// Returns a sine or a square wave. Its own frequency and phase take precedence over the settings.
fn periodic(build: &SettingsReader<'_>, table: &WaveTable, amplitude: f64) -> Result<Term, FileError> {
    let frequency = match table.frequency {
        Some(frequency) => frequency,
        None => build.number(Key::Frequency)?,
    };
    let random = table.phase.is_none() && build.text(Key::Phase) == "random";
    let phase = match table.phase {
        Some(phase) => phase,
        None if random => 0.0,
        None => build.number(Key::Phase).map_err(|_| {
            let phase = build.text(Key::Phase);
            let message = format!("'{phase}'; expected a number or \"random\"");
            FileError::key(Key::Phase, message)
        })?,
    };
    let wave = if table.wave == WaveName::Sine {
        Wave::Sine {
            amplitude,
            frequency,
            phase,
        }
    } else {
        Wave::Square {
            amplitude,
            frequency,
            phase,
        }
    };
    let term = if random { Term::RandomPhase } else { Term::Fixed };
    Ok(term(wave))
}
