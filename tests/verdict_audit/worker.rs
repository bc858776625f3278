//! A method as a program whose error is known: the plant is A = [1, -0.5], B = [0, 1], and `e_a` of a trial is |X| with
//! X from the law on its command line. `worker STREAM [OPTION ...] -- LAW`: a study (a cell's `eta`), a trial and a
//! stream have numbers of their own.
//!
//! Options: `lost P` (fails in this share of the trials), `lost-above X P` (and where X is above), `se S` (the standard
//! error of X that it states), `gain` (the error is that of `b`; `a` is right).

mod law;

use law::{Draws, Law, Stream};
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};

struct Options {
    stream: u64,
    lost: f64,
    above: f64,
    lost_above: f64,
    error: f64,
    gain: bool,
    law: Law,
}

fn options() -> Result<Options, String> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let mut words = words.iter().map(String::as_str);
    let mut found = Options {
        stream: 0,
        lost: 0.0,
        above: f64::INFINITY,
        lost_above: 0.0,
        error: 0.0,
        gain: false,
        law: Law::read(&mut ["const", "0"].into_iter())?,
    };
    found.stream = words
        .next()
        .and_then(|word| word.parse().ok())
        .ok_or("no stream")?;
    while let Some(option) = words.next().filter(|word| *word != "--") {
        let mut number = || {
            words
                .next()
                .and_then(|word| word.parse().ok())
                .ok_or("no number")
        };
        match option {
            "lost" => found.lost = number()?,
            "lost-above" => (found.above, found.lost_above) = (number()?, number()?),
            "se" => found.error = number()?,
            "gain" => found.gain = true,
            other => return Err(format!("unknown option {other}")),
        }
    }
    found.law = Law::read(&mut words)?;
    words
        .next()
        .map_or(Ok(found), |word| Err(format!("{word} is too much")))
}

/// Returns the number behind a key of a header.
fn number(header: &str, key: &str) -> Option<f64> {
    let (_, rest) = header.split_once(&format!("\"{key}\":"))?;
    rest.split([',', '}']).next()?.parse().ok()
}

/// Returns status, seconds, parameters and covariances of a batch with these seeds.
fn reply(options: &Options, eta: f64, samples: f64, seeds: &[f64]) -> [Vec<f64>; 4] {
    let mut blocks = [const { Vec::new() }; 4];
    for seed in seeds {
        let study = [*seed as u64, eta.to_bits(), samples as u64];
        let mut draws = Draws {
            common: Stream::new(&study[..2]),
            own: Stream::new(&[&study[..], &[options.stream + 1]].concat()),
            samples,
        };
        let error = options.law.draw(&mut draws);
        let chance = if error.abs() > options.above {
            options.lost_above
        } else {
            options.lost
        };
        let lost = draws.own.uniform() < chance;
        let (of_a, of_b) = if options.gain {
            (0.0, error)
        } else {
            (error, 0.0)
        };
        blocks[0].push(if lost { 2.0 } else { 0.0 });
        blocks[1].push(f64::NAN);
        blocks[2].extend([0.5 * of_a - 0.5, 1.0 + of_b]);
        let variance = options.error.powi(2);
        blocks[3].extend([0.25 * variance, 0.0, 0.0, variance]);
    }
    if options.error == 0.0 {
        blocks[3].clear();
    }
    blocks
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let options = options()?;
    let mut requests = BufReader::new(File::open(std::env::var("ASOBENCH_REQUESTS")?)?);
    let mut replies = File::options()
        .write(true)
        .open(std::env::var("ASOBENCH_REPLIES")?)?;
    let (mut eta, mut samples, mut header) = (0.0, 0.0, String::new());
    while requests.read_line(&mut header)? > 0 {
        let of = |key: &str| number(&header, key).ok_or(format!("no {key} in {header}"));
        if header.contains("\"frame\":\"hello\"") {
            (eta, samples) = (of("eta")?, of("samples")?);
            replies.write_all(
                b"{\"frame\":\"ready\",\"protocol\":1,\"name\":\"law\",\"version\":\"1\",\"returns\":\"polynomials\",\
                  \"deterministic\":true}\n",
            )?;
        } else {
            let (id, trials) = (of("number")?, of("trials")?);
            let mut blocks = vec![0; of("bytes")? as usize];
            requests.read_exact(&mut blocks)?;
            let seeds = blocks
                .chunks_exact(8)
                .skip(trials as usize)
                .take(trials as usize);
            let seeds = seeds.map(|bytes| bytes.try_into().map(f64::from_le_bytes));
            let answer = reply(
                &options,
                eta,
                samples,
                &seeds.collect::<Result<Vec<_>, _>>()?,
            );
            let content: Vec<u8> = answer
                .concat()
                .iter()
                .flat_map(|x| x.to_le_bytes())
                .collect();
            let covariance = options.error > 0.0;
            let header = format!(
                "{{\"frame\":\"reply\",\"number\":{id},\"trials\":{trials},\"na\":1,\"nb\":1,\"nk\":1,\
                 \"covariance\":{covariance},\"reasons\":[\"lost\"],\"bytes\":{}}}\n",
                content.len()
            );
            replies.write_all(&[header.as_bytes(), &content, b"\n"].concat())?;
        }
        header.clear();
    }
    Ok(())
}
