//! The closed loop from sample to sample as a matrix.

use nalgebra::{SMatrix, SVector};

use super::gains::LoopGains;
use super::held::HeldStep;

/// `X(k+1) = F·X(k) + …` with `X = (x, u(k−1), S(k−1), e(k−1))`: the axis with N
/// states, and what the controller remembers. D is N + 3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClosedLoop<const D: usize> {
    /// `F`.
    pub(crate) transition: SMatrix<f64, D, D>,
    /// What an error of 1 rad at the motor adds to X(k+1).
    pub(crate) per_error: SVector<f64, D>,
    /// What a volt on top of the law's adds to X(k+1).
    pub(crate) per_volt: SVector<f64, D>,
    /// The law's voltage `u(k)` as coefficients of X(k) …
    pub(crate) voltage: SVector<f64, D>,
    /// … and of an error of 1 rad at t_k.
    pub(crate) voltage_per_error: f64,
}

impl<const D: usize> ClosedLoop<D> {
    /// The loop around a held step.
    pub(crate) fn new<const N: usize>(
        step: &HeldStep<N>,
        gains: &LoopGains,
        gear_ratio: f64,
        period_s: f64,
    ) -> Self {
        let (past, sum, error) = (N, N + 1, N + 2);
        let (kp, ki, kd) = (gains.kp_v_per_rad, gains.ki_v_per_rads, gains.kd_vs_per_rad);
        // u = (K_p + K_i·T + K_d/T)·e + K_i·S − K_d/T·e_prev, e = −β/z.
        let voltage_per_error = kp + ki * period_s + kd / period_s;
        let mut measured = SVector::<f64, D>::zeros();
        measured[0] = -1.0 / gear_ratio;
        let mut voltage = measured * voltage_per_error;
        voltage[sum] += ki;
        voltage[error] -= kd / period_s;

        let mut per_volt = SVector::<f64, D>::zeros();
        per_volt.fixed_rows_mut::<N>(0).copy_from(&step.present);
        per_volt[past] = 1.0;
        let mut free = SMatrix::<f64, D, D>::zeros();
        free.fixed_view_mut::<N, N>(0, 0)
            .copy_from(&(SMatrix::<f64, N, N>::identity() + step.change));
        free.fixed_view_mut::<N, 1>(0, past).copy_from(&step.past);
        free[(sum, sum)] = 1.0;
        let mut remembered = SVector::<f64, D>::zeros();
        remembered[sum] = period_s;
        remembered[error] = 1.0;
        Self {
            transition: free + per_volt * voltage.transpose() + remembered * measured.transpose(),
            per_error: per_volt * voltage_per_error + remembered,
            per_volt,
            voltage,
            voltage_per_error,
        }
    }
}
