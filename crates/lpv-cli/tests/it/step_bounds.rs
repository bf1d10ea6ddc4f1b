//! What the bound of a step bounds: the plant as it flies where that is linear, else its model; and what takes it away.

use crate::program::{DOUBLE_INTEGRATOR, Place, QUADROTOR, edited};
use serde_json::Value;
use std::path::Path;

/// The record of a run of the scenario `text`, and what it printed.
fn run(text: impl AsRef<[u8]>, options: &str) -> (Value, String) {
    let place = Place::with(text);
    let table = place.succeed(&format!("run scenario.toml --out flown {options}"));
    (place.json("flown/run.json"), table)
}

fn case(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/soundness").join(file);
    std::fs::read_to_string(path).unwrap()
}

fn step_claim(controller: &Value, step: usize) -> &Value {
    let claims = controller["flight_claims"].as_array().unwrap();
    claims.iter().find(|claim| claim["kind"] == "step-cost" && claim["step"] == step).unwrap()
}

fn controllers(record: &Value) -> &[Value] {
    record["controllers"].as_array().unwrap()
}

/// The pendulum's flight costs 1.3595, its model's bound is 1.3000: that is no guarantee.
#[test]
fn a_bound_of_the_model_is_no_guarantee() {
    let (record, table) = run(case("bound_of_the_model.toml"), "");
    for controller in controllers(&record) {
        assert_eq!(controller["guaranteed_cost"], Value::Null, "{controller}");
        assert_eq!(controller["guaranteed_cost_of"], "model");
        let [bound, cost] = ["model_cost_bound", "actual_cost"].map(|key| controller[key].as_f64().unwrap());
        assert!((1.29..1.31).contains(&bound) && cost > bound, "{bound} {cost}");
        let detail = step_claim(controller, 1)["detail"].as_str().unwrap();
        assert!(detail.contains("of the LPV model in continuous time"), "{detail}");
    }
    assert!(table.contains("model: ≤ 1.300"), "{table}");
    assert!(table.contains("exceeded by the flight") && !table.contains(" ≤ 1.3001 (proved"), "{table}");
    // proved of the model it is still the model's
    let (record, table) = run(case("bound_of_the_model.toml"), "--prove");
    assert!(table.contains("model: ≤ 1.300") && table.contains("(proved: exceeded by the flight)"), "{table}");
    assert_eq!(controllers(&record)[0]["guaranteed_cost"], Value::Null);
}

/// Close to rest the pendulum itself is bounded, by what is proved of its sine, with a controller in continuous time; farther out its model alone.
#[test]
fn a_small_step_of_the_pendulum_is_bounded_itself() {
    let (record, table) = run(case("bound_of_the_model.toml"), "--nonlinear");
    assert!(table.contains("model: ≤ 1.300"), "{table}");
    assert_eq!(controllers(&record)[0]["plant_cost_bound"], Value::Null);
    let text = edited(&case("bound_of_the_model.toml"), "x_1 = -0.997438, x_2 = 1.388862", "x_1 = -0.05, x_2 = 0.05");
    let (record, table) = run(&text, "--nonlinear");
    for controller in controllers(&record) {
        assert_eq!(
            (&controller["guaranteed_cost"], &controller["model_cost_bound"]),
            (&Value::Null, &Value::Null),
            "{table}"
        );
        assert_eq!(controller["guaranteed_cost_of"], "plant-in-continuous-time");
        let [bound, cost] = ["plant_cost_bound", "actual_cost"].map(|key| controller[key].as_f64().unwrap());
        assert!(cost <= bound && bound < 1.2 * cost, "{cost} {bound}");
        assert_eq!(step_claim(controller, 1)["premises"], serde_json::json!(["plant.cost"]));
        let claims = controller["design_claims"].as_array().unwrap();
        assert!(claims.iter().any(|claim| claim["id"] == "plant.cost" && claim["verdict"] == "proved"), "{controller}");
    }
    assert!(table.contains("plant in continuous time: ≤ ") && table.contains("(proved)"), "{table}");
}

#[test]
fn a_reference_that_no_input_holds_has_no_bound() {
    let (record, table) = run(case("step_not_at_rest.toml"), "");
    let controller = &controllers(&record)[0];
    for key in ["guaranteed_cost", "model_cost_bound"] {
        assert_eq!(controller[key], Value::Null, "{key}");
    }
    let claim = step_claim(controller, 1);
    assert_eq!(claim["verdict"], "undecided");
    // 15.77560976 · 0.2
    assert!(claim["detail"].as_str().unwrap().contains("x_4 moves at 3.1551"), "{claim}");
    assert!(table.contains("reference not at rest"), "{table}");
}

/// A double integrator at three sample times: the bound is of the loop that flies, and no flight is above it.
#[test]
fn a_linear_plant_has_a_guarantee_as_it_flies() {
    let mut last = 0.0;
    for sample_time in ["0.001", "0.02", "0.1"] {
        let text = edited(DOUBLE_INTEGRATOR, "sample_time_s = 0.01", &format!("sample_time_s = {sample_time}"));
        let text = edited(&text, "record_interval_s = 0.05", "record_interval_s = 0.1");
        let (record, table) = run(text, "");
        let [regulator, saturated, high_gain, filtered] = controllers(&record) else { panic!("four") };
        for controller in [saturated, high_gain] {
            assert_eq!(controller["guaranteed_cost_verdict"], "proved", "{table}");
            assert_eq!(
                (&controller["guaranteed_cost_of"], &controller["model_cost_bound"]),
                (&"plant".into(), &Value::Null)
            );
            let [bound, cost] = ["guaranteed_cost", "actual_cost"].map(|key| controller[key].as_f64().unwrap());
            assert!(cost <= bound && bound < 2.0 * cost, "{sample_time}: {cost} {bound}");
            let claim = step_claim(controller, 1);
            assert_eq!((&claim["of"], &claim["premises"]), (&"plant".into(), &serde_json::json!(["sampled-cost"])));
            let premise = controller["flight_claims"].as_array().unwrap().iter().find(|c| c["id"] == "sampled-cost");
            let premise = premise.unwrap();
            assert_eq!(premise["verdict"], "proved");
            assert!(
                premise["claim"].as_str().unwrap().contains(&format!("sampled at T = {sample_time} s")),
                "{premise}"
            );
        }
        // the regulator starts outside its set, and says by how much; noise takes the bound of the last away
        let share = regulator["step_bounds"][0]["share"].as_f64().unwrap();
        assert!(share > 1.0 && table.contains("outside (V = "), "{share} {table}");
        for controller in [regulator, filtered] {
            assert_eq!(controller["guaranteed_cost"], Value::Null);
        }
        assert_eq!(filtered["guaranteed_cost_verdict"], "undecided");
        let factor = high_gain["step_bounds"][0]["factor"].as_f64().unwrap();
        assert!(factor > last, "{sample_time}: {factor}");
        last = factor;
    }
}

/// One state, whose flight costs exactly κV: it is above the bound by the integration's error at most, and that is no contradiction.
#[test]
fn one_state_flies_at_its_bound() {
    for (sample_time, steps) in [("0.5", 1), ("0.5", 20), ("0.01", 1)] {
        let text = format!(
            "name = \"one\"\n[plant]\nname = \"linear\"\nA = [[0.5]]\nB = [[1]]\n[weights]\nQ_diag = [1]\nR_diag = [1]\n\
             [simulation]\nduration_s = 40\nsample_time_s = {sample_time}\nsteps_per_sample = {steps}\n\
             initial_state = {{ x_1 = 1.0 }}\n[[set_point]]\ntime_s = 0\nx_1 = 0.0\n\
             [[controller]]\nname = \"k\"\nmethod = \"lpvqr\"\n"
        );
        let (record, table) = run(text, "");
        let controller = &controllers(&record)[0];
        let [bound, cost] = ["guaranteed_cost", "actual_cost"].map(|key| controller[key].as_f64().unwrap());
        assert!((bound / cost - 1.0).abs() < 1e-3 && table.contains("(proved"), "{bound} {cost} {table}");
        assert!(steps == 1 || bound >= cost * (1.0 - 1e-12), "{bound} {cost}");
    }
}

/// What happens before the first step is part of the flight's cost, and in no step's bound.
#[test]
fn a_flight_that_moves_before_its_first_step_has_no_guarantee() {
    let text = edited(DOUBLE_INTEGRATOR, "[noise]", "[simulation.initial_state]\nx_2 = 0.2\n\n[noise]");
    let text = edited(&text, "x_1 = 0.5", "x_1 = 0.5\nx_2 = 0.0");
    let (record, _) = run(text, "");
    for controller in controllers(&record) {
        assert_eq!((&controller["guaranteed_cost"], &controller["model_cost_bound"]), (&Value::Null, &Value::Null));
    }
}

#[test]
fn the_quadrotor_holds_no_tilt_and_no_speed() {
    for (target, state, rate) in [("phi_deg = 2", "v_y", -0.342), ("v_x = 0.5", "r_x", 0.5)] {
        let (record, table) = run(edited(QUADROTOR, "r_x = 0.5", target), "");
        assert!(table.contains("reference not at rest"), "{table}");
        for controller in controllers(&record) {
            assert_eq!((&controller["guaranteed_cost"], &controller["model_cost_bound"]), (&Value::Null, &Value::Null));
            let bound = &controller["step_bounds"][0];
            let moves = &bound["unmet"][0];
            assert_eq!(moves["kind"], "reference-moves", "{bound}");
            assert!((moves["rate"].as_f64().unwrap() - rate).abs() < 1e-3, "{moves}");
            let detail = step_claim(controller, 1)["detail"].as_str().unwrap();
            assert!(detail.contains(&format!("the reference is not at rest: {state} moves at ")), "{detail}");
        }
    }
}

#[test]
fn a_hover_outside_the_limits_is_refused() {
    let place = Place::with(edited(QUADROTOR, "max = 9.807", "max = 4.0"));
    place.lpv("run scenario.toml").refuses(2, &["limits", "4"]);
}

/// A yaw beyond half a turn is the yaw within it.
#[test]
fn a_yaw_beyond_its_range_is_the_same_yaw() {
    let bound = |yaw: &str| {
        let (record, _) = run(edited(QUADROTOR, "psi_deg = 20", yaw), "");
        controllers(&record)[1]["step_bounds"][0]["value"].as_f64().unwrap()
    };
    let [within, beyond, far] = ["psi_deg = 20", "psi_deg = 380", "psi_deg = -340"].map(bound);
    assert!((beyond / within - 1.0).abs() < 1e-9 && (far / within - 1.0).abs() < 1e-9, "{within} {beyond} {far}");
}

/// A design for a rate that is proved in the run: its step is proved of the model, while the yaw keeps to the rate.
#[test]
fn a_proved_design_has_a_proved_step_of_the_model() {
    let rate = "method = \"slpvqr\"\ngamma = 10\nrate_bound = 0.5\nrequire = \"proved\"\n\n[[controller]]\nname = \"filtered\"";
    let text = edited(QUADROTOR, "method = \"slpvqr\"\ngamma = 10\n\n[[controller]]\nname = \"filtered\"", rate);
    let text = edited(&text, "r_x = 0.5\npsi_deg = 20", "r_x = 0.3");
    let text = edited(&text, "grid_points = 4", "grid_points = 16");
    let (record, table) = run(text, "");
    let controller = &controllers(&record)[1];
    let bound = &controller["step_bounds"][0];
    assert_eq!(
        (&bound["verdict"], &bound["of"], &bound["while_rate"]),
        (&"proved".into(), &"model".into(), &0.5.into())
    );
    assert!(table.contains("(proved: while |dpsi/dt| <= 0.5 rad/s)"), "{table}");
    let [value, factor, whole] = ["value", "factor", "bound"].map(|key| bound[key].as_f64().unwrap());
    assert!(factor == 1.01 && whole >= value * factor && whole < value * factor * (1.0 + 1e-12), "{bound}");
    assert_eq!(controller["guaranteed_cost"], Value::Null);
    assert_eq!(controller["model_cost_bound"], bound["bound"]);
    assert_eq!(step_claim(controller, 1)["premises"], serde_json::json!(["cost"]));
}
