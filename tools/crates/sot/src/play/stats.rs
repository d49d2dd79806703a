//! Confidence intervals, 95 %.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// The normal distribution's 97.5 % quantile.
const Z: f64 = 1.959_964;

/// A value and the interval that it lies in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// As measured.
    pub value: f64,
    /// Lower and upper end of the interval.
    pub low: f64,
    /// See [`Estimate::low`].
    pub high: f64,
}

/// A share of `count` trials (Wilson's interval); None without trials.
pub fn share(successes: usize, count: usize) -> Option<Estimate> {
    if count == 0 {
        return None;
    }
    let (n, p) = (count as f64, successes as f64 / count as f64);
    let middle = (p + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    Some(Estimate { value: p, low: (middle - half).max(0.0), high: (middle + half).min(1.0) })
}

/// Student's 97.5 % quantile; None below one degree of freedom.
fn student(degrees: f64) -> Option<f64> {
    let distribution = StudentsT::new(0.0, 1.0, degrees).ok()?;
    (degrees >= 1.0).then(|| distribution.inverse_cdf(0.975))
}

/// The mean of some values (Student's interval); None for fewer than two.
pub fn mean(values: &[f64]) -> Option<Estimate> {
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - value) * (v - value)).sum::<f64>() / (n - 1.0);
    let half = student(n - 1.0)? * (variance / n).sqrt();
    Some(Estimate { value, low: value - half, high: value + half })
}

/// The middle of some values; None without any.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (low, high) = (sorted.len().checked_sub(1)? / 2, sorted.len() / 2);
    Some((sorted[low] + sorted[high]) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_s_interval_is_that_of_the_textbooks() {
        // 90 of 100: 0.8256 to 0.9448.
        let estimate = share(90, 100).expect("trials");
        assert!((estimate.low - 0.8256).abs() < 1e-4 && (estimate.high - 0.9448).abs() < 1e-4);
        assert_eq!(share(0, 0), None);
        let none = share(0, 20).expect("trials");
        assert!(none.low == 0.0 && (none.high - 0.1611).abs() < 1e-3, "{none:?}");
    }

    #[test]
    fn student_s_quantiles_are_those_of_the_tables() {
        for (degrees, quantile) in [(1.0, 12.706), (3.0, 3.182), (9.0, 2.262), (39.0, 2.023)] {
            let off = student(degrees).expect("one degree at least") - quantile;
            assert!(off.abs() < 6e-4, "{degrees}: {off}");
        }
        assert_eq!(student(0.0), None);
    }

    #[test]
    fn a_mean_lies_in_the_middle_of_its_interval() {
        let estimate = mean(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).expect("values");
        assert_eq!(estimate.value, 3.5);
        assert!((estimate.high - 3.5 - 1.963).abs() < 0.01, "{estimate:?}");
        assert_eq!(mean(&[1.0]), None);
        assert_eq!(median(&[3.0, 1.0, 2.0, 9.0]), Some(2.5));
    }
}
