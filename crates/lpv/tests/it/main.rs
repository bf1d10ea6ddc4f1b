//! Integration tests of the library: the mathematics against the thesis, closed forms and residuals.

mod closed_loop;
mod costs;
mod filter;
mod flight;
mod governed;
mod jacobians;
mod moving_parameter;
mod numbers;
mod polytopic;
mod proofs;
mod quadrotor;
mod records;
mod rowwise;
mod sampled;
mod sampled_cost;
mod scheduled;
mod synthesis;
mod tensor_product;
mod trade_off;
mod units;
