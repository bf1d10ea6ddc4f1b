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
        (1, "SLQR, γ = 1", "guaranteed cost", 5.92367, 1e-4),
        (1, "SLQR, γ = 1", "actual cost", 14.6289, 1e-4),
        (1, "SLQR, γ = 30", "actual cost", 39.6808, 5e-4),
        (1, "SLQR, γ = 60", "guaranteed cost", 59.6849, 1e-4),
        (1, "High-gain SLQR, γ = 60", "actual cost", 14.16, 1e-2),
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
    assert_eq!(page.matches("<h2").count(), 4);
    place.lpv("thesis").refuses(2, &["out/thesis", "--force"]);
}
