//! Makes a cell in continuous time from its settings.

use crate::design::continuous_cell::{ContinuousCell, Term};
use crate::design::file::continuous_tables::{
    ContinuousPlantTable, ContinuousTable, FilterTable, WaveName, WaveTable,
};
use crate::design::file::error::FileError;
use crate::design::file::key::Key;
use crate::design::file::observer_table::{
    FactorName, KalmanBucyOptions, LuenbergerOptions, ObserverOptions,
};
use crate::design::settings_reader::{SettingsReader, unknown};
use crate::text;
use asobench_identification::observer::gpebo::{
    CascadeError, Factor, GpeboOptions, ObserverSpec, Operator,
};
use asobench_identification::observer::{butterworth, care, parse_poles, place};
use asobench_identification::plant::ContinuousPlant;
use asobench_identification::signal::{Hold, Signal, Wave};
use faer::Mat;

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
            observer(&table.observer, &plant, &xi0, scale)
                .map_err(|message| FileError::key(&place, message))
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
        CascadeError::Observer { number, source } => {
            FileError::key(&format!("observers[{}]", number - 1), source.to_string())
        }
        CascadeError::Signal { source, .. } => {
            FileError::key(Key::Disturbance.name(), source.to_string())
        }
        other => FileError::key("continuous", other.to_string()),
    }
}

/// Checks the times of the table.
fn times(table: &ContinuousTable) -> Result<(), FileError> {
    let positive = |x: f64| x > 0.0 && x.is_finite();
    let wrong = |key: &str, value: f64, expected: &str| {
        let message = format!("{}; expected {expected}", text::number(value));
        Err(FileError::key(&format!("continuous.{key}"), message))
    };
    if !positive(table.until) {
        return wrong("until", table.until, "a time above 0, in seconds");
    }
    if !(0.0..table.until).contains(&table.scored_from) {
        return wrong(
            "scored_from",
            table.scored_from,
            "a time from 0 to less than 'until'",
        );
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
    let known = CONTINUOUS_PLANTS
        .into_iter()
        .chain(tables.keys().map(String::as_str));
    let known: Vec<&str> = known.collect();
    let table = tables
        .get(&name)
        .ok_or_else(|| unknown(Key::Plant, &name, &known))?;
    let ContinuousPlantTable { a, b, c, x0, xi0 } = table;
    let wrong = |message: String| FileError::key(&format!("continuous_plants.{name}"), message);
    let plant = ContinuousPlant::new(a, b.clone(), c.clone()).map_err(|e| wrong(e.to_string()))?;
    let n = plant.order();
    if n > MOST_STATES {
        return Err(wrong(format!("{n} states; expected at most {MOST_STATES}")));
    }
    let xi0 = xi0.clone().unwrap_or_else(|| vec![0.0; n]);
    for (key, x) in [("x0", x0), ("xi0", &xi0)] {
        if x.len() != n || !x.iter().all(|x| x.is_finite()) {
            return Err(wrong(format!(
                "{key}; expected {n} finite numbers, one per state"
            )));
        }
    }
    Ok((plant, x0.clone(), xi0))
}

fn positive(build: &SettingsReader<'_>, key: Key) -> Result<f64, FileError> {
    let number = build.number(key)?;
    if number > 0.0 {
        return Ok(number);
    }
    Err(FileError::key(
        key.name(),
        format!("{}; expected a number above 0", text::number(number)),
    ))
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
    let wave = match name.as_str() {
        "none" => return Ok(Vec::new()),
        "constant" => WaveName::Constant,
        "ramp" => WaveName::Ramp,
        "sine" => WaveName::Sine,
        "square" => WaveName::Square,
        "white" => WaveName::White,
        _ => {
            let tables = &build.file.signals;
            let known = SIGNALS.into_iter().chain(tables.keys().map(String::as_str));
            let known: Vec<&str> = known.collect();
            let table = tables.get(&name);
            let table = table.ok_or_else(|| unknown(Key::Disturbance, &name, &known))?;
            let place = |i: usize| format!("signals.{name}.waves[{i}]");
            if table.waves.len() > MOST_TERMS {
                let message = format!("{} waves; expected at most {MOST_TERMS}", table.waves.len());
                return Err(FileError::key(&format!("signals.{name}"), message));
            }
            let waves = table.waves.iter().enumerate();
            return waves
                .map(|(i, wave)| term(build, wave, until, &place(i)))
                .collect();
        }
    };
    let table = WaveTable {
        wave,
        amplitude: 1.0,
        ..WaveTable::default()
    };
    Ok(vec![term(build, &table, until, "settings")?])
}

/// Returns one term, times the level.
fn term(
    build: &SettingsReader<'_>,
    table: &WaveTable,
    until: f64,
    place: &str,
) -> Result<Term, FileError> {
    let level = build.number(Key::Level)?;
    let amplitude = table.amplitude * level;
    let wrong = |message: String| Err(FileError::key(place, message));
    if !amplitude.is_finite() {
        return wrong(format!(
            "amplitude {}; expected a finite number",
            table.amplitude
        ));
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
                return Err(FileError::key(Key::NoiseHold.name(), message));
            }
            Ok(Term::White {
                deviation: amplitude.abs(),
                hold,
            })
        }
        WaveName::File => {
            let (Some(interval), Some(values)) = (table.interval, &table.values) else {
                return wrong("expected file = \"NAME.csv\" beside wave = \"file\"".to_owned());
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
fn periodic(
    build: &SettingsReader<'_>,
    table: &WaveTable,
    amplitude: f64,
) -> Result<Term, FileError> {
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
            FileError::key(Key::Phase.name(), message)
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
    let term = if random {
        Term::RandomPhase
    } else {
        Term::Fixed
    };
    Ok(term(wave))
}

/// Makes an observer from its options. Luenberger observers start from xi(0), as GPEBO does.
fn observer(
    options: &ObserverOptions,
    plant: &ContinuousPlant,
    xi0: &[f64],
    scale: f64,
) -> Result<ObserverSpec, String> {
    let n = plant.order();
    Ok(match options {
        ObserverOptions::Luenberger(options) => full_order(luenberger(options, plant)?, xi0),
        ObserverOptions::Gradient(options) => ObserverSpec::Gradient {
            gains: gains(&options.gains, n, scale)?,
        },
        ObserverOptions::FiniteTime(options) => ObserverSpec::FiniteTime {
            gains: gains(&options.gains, n, scale)?,
            share: options.share.unwrap_or(0.5),
        },
        ObserverOptions::LsDrem(options) => ObserverSpec::LsDrem {
            gains: gains(&options.gains, n, scale)?,
            p0: options.prior,
            r: options.measurement,
        },
        ObserverOptions::Proposed(options) => {
            let order = options.expansion.unwrap_or(2);
            // The default: the paper's filters, 2/(p + 2) and 6/(p + 6).
            let paper = [Operator::Lag(2.0), Operator::Lag(6.0)];
            let filters = options.filters.as_deref().map(operators);
            ObserverSpec::Proposed {
                k: options.pole.unwrap_or(1.0),
                order,
                filters: filters.unwrap_or_else(|| paper.into_iter().take(order).collect()),
                gains: gains(&options.gains, n, scale)?,
                factor: match options.factor.unwrap_or_default() {
                    FactorName::Keep => Factor::Keep,
                    FactorName::Drop => Factor::Drop,
                },
            }
        }
        ObserverOptions::KalmanBucy(options) => kalman_bucy(options, plant, xi0)?,
    })
}

fn full_order(gain: Vec<f64>, xi0: &[f64]) -> ObserverSpec {
    ObserverSpec::Luenberger {
        gain,
        x0: xi0.to_vec(),
    }
}

/// Returns the gain L.
fn luenberger(options: &LuenbergerOptions, plant: &ContinuousPlant) -> Result<Vec<f64>, String> {
    let poles = match (&options.gain, &options.poles, options.bandwidth) {
        (Some(gain), None, None) => return Ok(gain.clone()),
        (None, Some(list), None) => parse_poles(list).map_err(|error| error.to_string())?,
        (None, None, Some(radius)) if radius > 0.0 => butterworth(plant.order(), radius),
        (None, None, Some(radius)) => {
            let radius = text::number(radius);
            return Err(format!("bandwidth {radius}; expected a number above 0"));
        }
        _ => return Err("expected one of 'gain', 'poles' and 'bandwidth'".to_owned()),
    };
    place(plant.a(), plant.c(), &poles).map_err(|error| error.to_string())
}

/// Makes the Kalman-Bucy filter: with a prior the time-varying one, which without process noise is least squares on
/// theta; else the steady-state one, which is a full-order observer.
fn kalman_bucy(
    options: &KalmanBucyOptions,
    plant: &ContinuousPlant,
    xi0: &[f64],
) -> Result<ObserverSpec, String> {
    let r = options.measurement;
    match (options.process, options.prior) {
        (None | Some(0.0), None) => Err("expected 'process' above 0, or 'prior'".to_owned()),
        (None | Some(0.0), Some(p0)) => Ok(ObserverSpec::KalmanBucy { p0, r }),
        (Some(q), Some(p0)) => Ok(ObserverSpec::Filter {
            p0,
            q,
            r,
            x0: xi0.to_vec(),
        }),
        (Some(q), None) => {
            let n = plant.order();
            let noise = Mat::from_fn(n, n, |i, j| if i == j { q } else { 0.0 });
            let solved = care(plant.a(), plant.c(), noise.as_ref(), r);
            let solved = solved.map_err(|error| error.to_string())?;
            Ok(full_order(solved.gain, xi0))
        }
    }
}

fn operators(filters: &[FilterTable]) -> Vec<Operator> {
    let operator = |filter: &FilterTable| match filter {
        FilterTable::Pole(pole) => Operator::Lag(*pole),
        FilterTable::Delay(table) => Operator::Delay(table.delay),
    };
    filters.iter().map(operator).collect()
}

/// Returns the adaptation gains times their scale. A single gain applies to all components.
fn gains(given: &[f64], n: usize, scale: f64) -> Result<Vec<f64>, String> {
    let all = match given {
        [value] => vec![*value; n],
        all if all.len() == n => all.to_vec(),
        _ => return Err(format!("gains; expected {n} numbers, or one for all")),
    };
    Ok(all.into_iter().map(|gain| gain * scale).collect())
}
