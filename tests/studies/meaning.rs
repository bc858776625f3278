//! Keys that mean nothing: refused with their names and what was expected.

use super::{Place, succeeds};

/// A key that means nothing is no setting: it would be a list without an effect.
#[test]
fn what_means_nothing_is_refused() {
    let place = Place::new();
    let random = "[settings]\nplant = [\"nikolov2023\", \"random\"]\n";
    for (text, parts) in [
        (
            "[[methods]]\n[[methods]]\nname = \"r\"\ninstruments = [\"u\", \"r\"]",
            ["methods[2].instruments: \"r\"", "no cell has feedback"],
        ),
        (
            "exclude = [{ eta = 2 }, { eta = 3 }]\n[settings]\neta = [1, 2]",
            ["exclude[1]", "no cell has these values"],
        ),
        ("exclude = [{ l = 20 }]", ["exclude[0]", "no cell has these values"]),
        (
            "[settings]\nclaim = [\"C2\", \"C3\"]\n[[bounds]]\nclaim = \"C4\"\nmeasure = \"e_a\"\nbelow = 1",
            ["bounds[0].claim", "the claim 'C4'"],
        ),
        (
            "[settings]\nplant_order = [2, 6]",
            ["plant_order", "plant = \"random\""],
        ),
        ("[settings]\npole_radius = 0.5", ["pole_radius", "plant = \"random\""]),
        ("[[methods]]\nname = \"\"", ["methods[0].name: ''", "not empty"]),
        ("[[methods]]\nname = \" \"", ["methods[0].name", "not empty"]),
        (
            "[[methods]]\nname = \"iv(4)\"",
            ["methods[0].name: 'iv(4)'", "without parentheses"],
        ),
    ] {
        place.refuses_file(text, &parts);
    }
    for text in [
        "claims = [\"C1\", \"W1\"]",
        &format!("{random}plant_order = [2, 6]\npole_radius = 0.5"),
        "[settings]\nfeedback = [\"none\", \"m\"]\n[feedbacks.m]\nnumerator = [0.3]\n\
         [[methods]]\ninstruments = \"r\"",
    ] {
        place.accepts_file(text.as_bytes());
    }
    // A filter may be left without a cell by --set and by the quick variant, for which it was not written.
    let text = "exclude = [{ eta = 2, window = 98 }]\n[settings]\neta = [1, 2]\nwindow = [98, 218]\n\
                [quick]\ntrials = 2\nsettings = { window = 18 }";
    place.write("filter.toml", text.as_bytes());
    for more in [&[][..], &["--set", "eta=[1, 3]"], &["--quick"]] {
        succeeds(&place.run(&[&["check", "filter.toml"], more].concat()));
    }
}

#[test]
fn a_file_without_a_quick_variant_has_none() {
    let place = Place::new();
    for command in [&["check"][..], &["run", "--out", "out"]] {
        let arguments = [command, &["everything.toml", "--quick"]].concat();
        place.refuses(&arguments, &["everything.toml: quick: ", "expected [quick]"]);
    }
    assert!(!place.path("out").exists());
}
