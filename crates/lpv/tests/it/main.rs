//! Integration tests of the library: the mathematics against the thesis, closed forms and residuals.

mod closed_loop;
mod costs;
mod filter;
mod flight;
mod governed;
mod jacobians;
mod layering;
mod moving_parameter;
mod polytopic;
mod proofs;
mod quadrotor;
mod records;
mod rowwise;
<<<<<<< HEAD
mod sampled_cost;
=======
mod sampled;
>>>>>>> 8113a8d8881cbedf4c190448d0ffb20ba0391fe8
mod synthesis;
mod tensor_product;
