//! The worth of the verdicts on a file's claims: how each claim came about, and how many were tested at what rate.

use crate::claim::family::Family;
use crate::claim::judged::{Judged, Standing};
use crate::design::file::{ClaimTable, ExperimentFile};
use crate::outcome::looks::Look;
use asobench_identification::text::rounded;

impl Standing {
    fn of(claim: &ClaimTable, file: &ExperimentFile) -> Self {
        match file.confirms {
            // Fresh trials owe nothing to what the author had seen.
            Some(_) if !claim.added_after_run => Self::Confirmation,
            None if claim.exploratory => Self::Exploratory,
            _ if claim.added_after_run => Self::Added,
            _ => Self::Planned,
        }
    }

    /// Whether the claim's level is the error rate of its verdict.
    fn has_rate(self) -> bool {
        matches!(self, Self::Planned | Self::Confirmation)
    }
}

/// Notes how a claim came about, also in its line.
pub(crate) fn mark(judged: &mut Judged, claim: &ClaimTable, file: &ExperimentFile) {
    judged.standing = Standing::of(claim, file);
    let words = match judged.standing {
        Standing::Exploratory => " Exploratory: written after results of the same kind were seen.".to_owned(),
        Standing::Confirmation => format!(" Confirmation by fresh trials, seed {}.", file.seed),
        Standing::Planned | Standing::Added => String::new(),
    };
    judged.line.push_str(&words);
}

/// Says how many claims were tested and at what rate; `None` if no claim was.
pub fn tested(file: &ExperimentFile, judged: &[Judged], look: Look) -> Option<String> {
    if judged.is_empty() {
        return None;
    }
    let mut text = file.confirms.map_or_else(String::new, |own| {
        let seed = file.seed;
        format!("A confirmation run: its seed is {seed}, that of the file is {own}. ")
    });
    let count = judged.len();
    let counted = match count {
        1 => "1 claim was tested".to_owned(),
        count => format!("{count} claims were tested"),
    };
    text.push_str(&counted);
    text.push_str(&rate(file, judged));
    let loose = judged.iter().filter(|claim| !claim.standing.has_rate());
    let loose = loose.count();
    if loose > 0 {
        let are = if loose == 1 { "is" } else { "are" };
        let words =
            format!(" No error rate holds for {loose} of them, which {are} exploratory or newer than the results.");
        text.push_str(&words);
    }
    // Later looks are told with each verdict.
    if look.number == 1 && look.share < 1.0 {
        text.push_str(" First look in this folder.");
    }
    Some(text)
}

/// The rate at which claims were tested, and how many wrong verdicts it lets through.
fn rate(file: &ExperimentFile, judged: &[Judged]) -> String {
    let per_cent = |level: f64| rounded(100.0 * level, 6);
    if let Some(family) = Family::of(file) {
        let level = per_cent(family.level);
        return match judged.len() {
            1 => format!(", at {level} % a side."),
            _ => format!(", at {level} % a side over all of them (Holm's correction)."),
        };
    }
    let claims = file.claims.iter().filter(|claim| !claim.test.is_empty());
    let levels: Vec<f64> = claims.map(|claim| claim.level).collect();
    let least = levels.iter().copied().fold(f64::INFINITY, f64::min);
    let most = levels.iter().copied().fold(0.0, f64::max);
    let text = match levels.len() {
        1 => return format!(", at {} % a side.", per_cent(most)),
        _ if least < most => format!(", at {} to {} % a side", per_cent(least), per_cent(most)),
        _ => format!(", each at {} % a side", per_cent(most)),
    };
    // At its limit a claim is wrongly decided at the level either way.
    let expected = rounded(2.0 * levels.iter().sum::<f64>(), 2);
    format!("{text}; if all were at their limits, up to {expected} wrong verdicts would be expected.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::judged::undecided;

    fn file(toml: &str, levels: &[f64]) -> ExperimentFile {
        let claims = levels.iter().enumerate().map(|(i, level)| {
            format!(
                "[[claims]]\nid = 'W{i}'\nlevel = {level}\n\
                 test = {{ value = 'e_a', of = 'ls', below = 1 }}\n"
            )
        });
        let claims: String = claims.collect();
        ExperimentFile::parse(&format!("{toml}\n{claims}")).unwrap()
    }

    fn said(file: &ExperimentFile) -> String {
        let judged = file.claims.iter().map(|claim| {
            let mut judged = undecided(claim, claim.level, "no trials");
            mark(&mut judged, claim, file);
            judged
        });
        tested(file, &judged.collect::<Vec<Judged>>(), Look::ONLY).unwrap()
    }

    /// Twelve claims at 2.5 % a side: 12 * 2 * 0.025 = 0.6.
    #[test]
    fn claims_are_counted_with_their_rate() {
        assert_eq!(
            said(&file("", &[0.025; 12])),
            "12 claims were tested, each at 2.5 % a side; if all were at their limits, up to 0.6 wrong verdicts would \
             be expected."
        );
        assert_eq!(
            said(&file("", &[0.01, 0.05])),
            "2 claims were tested, at 1 to 5 % a side; if all were at their limits, up to 0.12 wrong verdicts would be \
             expected."
        );
        assert_eq!(said(&file("", &[0.025])), "1 claim was tested, at 2.5 % a side.");
        assert_eq!(
            said(&file("family = true", &[0.01, 0.05])),
            "2 claims were tested, at 1 % a side over all of them (Holm's correction)."
        );
        let mut loose = file("family = true", &[0.025; 3]);
        loose.claims[1].exploratory = true;
        assert!(
            said(&loose)
                .ends_with("No error rate holds for 1 of them, which is exploratory or newer than the results.")
        );
        assert_eq!(tested(&ExperimentFile::default(), &[], Look::ONLY), None);
    }

    #[test]
    fn fresh_trials_make_an_exploratory_claim_a_confirmation() {
        let mut file = file("seed = 5", &[0.025]);
        let standing = |file: &ExperimentFile| Standing::of(&file.claims[0], file);
        assert_eq!(standing(&file), Standing::Planned);
        file.claims[0].exploratory = true;
        assert_eq!(standing(&file), Standing::Exploratory);
        file.confirms = Some(4);
        assert_eq!(standing(&file), Standing::Confirmation);
        assert_eq!(
            said(&file),
            "A confirmation run: its seed is 5, that of the file is 4. 1 claim was tested, at 2.5 % a side."
        );
        // Edited after the confirmation's results were seen.
        file.claims[0].added_after_run = true;
        assert_eq!(standing(&file), Standing::Added);
    }
}
