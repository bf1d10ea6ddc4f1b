//! `lpv thesis`: the numbers against independent ones, every figure, and a page that stands alone.

use crate::program::Place;
use serde_json::Value;

fn value(tables: &Value, table: usize, row: &str, quantity: &str) -> f64 {
    let entries = tables["tables"][table]["entries"].as_array().unwrap();
    let entry =
        entries.iter().find(|entry| entry["row"].as_str().unwrap().starts_with(row) && entry["quantity"] == quantity);
    entry.unwrap_or_else(|| panic!("{row}, {quantity}"))["value"].as_f64().unwrap()
}

#[test]
fn the_thesis_is_recomputed() {
    let place = Place::with("");
    let out = place.succeed("thesis --json");
    let tables: Value = serde_json::from_str(&out).unwrap();
    for (table, row, quantity, right, tolerance) in [
        (0, "Theorem 4.3", "guaranteed cost", 77.975, 1e-3),
        (0, "Corollary 4.1", "actual cost", 58.370, 1e-3),
        (0, "Theorem 4.4, |ẋ₁| ≤ π", "guaranteed cost", 77.0554, 1e-4),
        (0, "Theorem 4.4, |ẋ₁| ≤ π", "actual cost", 56.754, 1e-3),
        (0, "Theorem 4.4, |ẋ₁| ≤ 2", "guaranteed cost", 68.7353, 1e-4),
        (0, "Theorem 4.4, |ẋ₁| ≤ 2", "actual cost", 56.203, 1e-3),
        (0, "Theorem 4.5", "guaranteed cost", 55.865797, 1e-5),
        (0, "Theorem 4.5", "actual cost", 56.026, 1e-3),
        (0, "Least cost", "actual cost", 55.89497, 1e-5),
        (1, "LQR", "guaranteed cost", 0.130430, 1e-6),
        (1, "LQR", "actual cost", 12.9242, 1e-4),
        (0, "Theorem 4.3, least bound", "guaranteed cost", 74.901, 1e-3),
        (1, "LQR gain (5.6)", "K, entry 1", 31.622777, 1e-6),
        (1, "LQR gain (5.6)", "K, entry 2", 32.607446, 1e-6),
        (1, "SLQR gain (5.9)", "K, entry 1", 0.437796, 2e-6),
        (1, "SLQR gain (5.9)", "K, entry 2", 1.109393, 2e-6),
        (1, "High gain (5.14)", "s on K_s", 0.102, 1e-3),
        (1, "SLQR, γ = 1", "guaranteed cost", 5.92366, 2e-5),
        (1, "SLQR, γ = 30", "guaranteed cost", 39.68089, 5e-5),
        (1, "SLQR, γ = 1", "actual cost", 14.6289, 1e-4),
        (1, "SLQR, γ = 30", "actual cost", 39.68089, 5e-5),
        (1, "SLQR, γ = 60", "guaranteed cost", 59.6849, 1e-4),
        (1, "High-gain SLQR, γ = 1", "actual cost", 12.985, 1e-3),
        (1, "High-gain SLQR, γ = 60", "actual cost", 14.16, 1e-2),
        (2, "K(ψ) as printed, at ψ = 0", "max Re λ", 3.263, 1e-3),
        (2, "the same, columns", "max Re λ", -0.70705, 1e-4),
        (2, "K(ψ) as printed, at ψ + π", "from the Riccati gain", 0.0, 5e-6),
        (2, "Theorem 4.1, yaw within ±30°", "largest margin, tr Y = 12", 0.5115, 1e-4),
        (2, "Theorem 4.1, yaw within ±60°", "largest margin, tr Y = 12", 0.2360, 1e-4),
        (2, "Theorem 4.1, yaw within ±80°", "largest margin, tr Y = 12", 0.0497, 1e-4),
        (2, "Theorem 4.1, yaw within ±85°", "largest margin, tr Y = 12", 0.0170, 1e-4),
        (2, "Theorem 4.1, yaw within ±88°", "largest margin, tr Y = 12", 0.0039, 1e-4),
        (2, "Theorem 5.3, γ = 1", "tr Y", 5.472401, 2e-6),
        (2, "Theorem 5.3, γ = 10", "tr Y", 5.146219, 2e-6),
        (2, "Theorem 5.3, γ = 20", "tr Y", 5.087519, 2e-6),
        (2, "Theorem 5.3, γ = 1", "certified step in x / m", 0.65, 0.01),
        (2, "Theorem 5.3, γ = 20", "certified step in x / m", 1.81, 0.01),
        (2, "Theorem 5.4, γ = 20, s = 1", "max |λ| sampled", 45.0, 0.5),
        (2, "LPVQR, unbounded, step", "cost over 60 s", 2.1356, 1e-3),
        (2, "LPVQR, step", "settling to 5 % / s", 3.87, 0.02),
        (2, "SLPVQR, γ = 20, step", "settling to 5 % / s", 26.25, 0.02),
        (2, "LPVQR, x = y = z", "step that is lost / m", 5.25, 0.3),
        (2, "SLPVQR, γ = 1, x = y = z", "step that is lost / m", 17.5, 0.5),
        (2, "SLPVQR, γ = 10, x = y = z", "step that is lost / m", 70.0, 3.0),
        (2, "Theorem 5.3, γ = 1", "proved yaw rate / (rad/s)", 0.37, 0.01),
        (2, "EKF, 60 s", "mean eᵀP⁻¹e", 12.0, 0.7),
    ] {
        let found = value(&tables, table, row, quantity);
        assert!((found - right).abs() < tolerance, "{row}, {quantity}: {found} is not {right}");
    }
    let numbers = ["3.4", "4.1", "4.2", "4.3", "4.4", "4.5"].map(str::to_owned).into_iter();
    let numbers = numbers.chain((1..=9).map(|k| format!("5.{k}"))).chain((4..=16).map(|k| format!("6.{k}")));
    let page = place.read("out/thesis/report.html");
    for number in numbers {
        let svg = place.read(&format!("out/thesis/figure-{number}.svg"));
        assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"), "{number}");
        assert_eq!(svg.matches("<g ").count(), svg.matches("</g>").count(), "{number}");
        assert!(page.contains(&format!("id=\"figure-{number}\"")), "{number} is in the page");
    }
    assert!(!page.contains("NaN") && !page.contains("src=") && !page.contains("href="), "nothing from outside");
    assert_eq!(page.matches("<h2").count(), 5);
    let errata = tables["errata"].as_array().unwrap();
    for place in [
        "(2.60)",
        "(2.62)",
        "(3.19)",
        "(3.24)",
        "(3.32)",
        "(3.33)",
        "Ā₂",
        "Ā₃",
        "Ā₄",
        "before (4.21)",
        "(4.15)",
        "(A.19)",
    ]
    .into_iter()
    .chain(["(4.32)", "(4.35)", "(4.36)", "(A.30)", "(A.37)", "(6.3)", "(6.7)", "6.2.1", "6.2.2", "Theorem 5.2"])
    {
        let found = errata.iter().find(|erratum| erratum["place"].as_str().unwrap().starts_with(place));
        let found = found.unwrap_or_else(|| panic!("{place}"));
        assert!(
            !found["right"].as_str().unwrap().contains('–') && !found["printed"].as_str().unwrap().is_empty(),
            "{found}"
        );
    }
    place.lpv("thesis").refuses(2, &["out/thesis", "--force"]);
}
