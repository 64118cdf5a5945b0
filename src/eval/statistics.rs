//! Means, deviations, and 95 % intervals: Student's t for means, Wilson's for rates.
//!
//! Numbers come in, numbers go out. Imports nothing of donut.

/// The 97.5 % quantile of the standard normal distribution.
const Z: f64 = 1.959_963_984_540_054;
/// Those of Student's t with 1 to 10 degrees of freedom.
const T: [f64; 10] = [12.7062, 4.3027, 3.1824, 2.7764, 2.5706, 2.4469, 2.3646, 2.3060, 2.2622, 2.2281];

/// Mean of some numbers; not a number if there is none.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Standard deviation of a sample (divided by n - 1); 0 for a single number.
pub fn deviation(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return 0.0;
    }
    let m = mean(values);
    let squares: f64 = values.iter().map(|v| (v - m).powi(2)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

/// 95 % interval of the mean by Student's t; `None` for fewer than two numbers.
pub fn mean_interval(values: &[f64]) -> Option<[f64; 2]> {
    let n = values.len();
    let half = t_quantile(n.checked_sub(1).filter(|f| *f > 0)?) * deviation(values) / (n as f64).sqrt();
    let m = mean(values);
    Some([m - half, m + half])
}

/// 95 % interval of a rate (Wilson 1927, "Probable inference, the law of succession, and statistical inference").
pub fn rate_interval(successes: usize, trials: usize) -> Option<[f64; 2]> {
    if trials == 0 {
        return None;
    }
    let (n, p) = (trials as f64, successes as f64 / trials as f64);
    let middle = p + Z * Z / (2.0 * n);
    let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    // At 0 and n successes an end is 0 or 1 exactly, which rounding would miss.
    let low = if successes == 0 { 0.0 } else { (middle - half) / scale };
    let high = if successes == trials { 1.0 } else { (middle + half) / scale };
    Some([low, high])
}

/// The 97.5 % quantile of Student's t. From 11 degrees of freedom on by the expansion around the normal quantile
/// (Abramowitz and Stegun, 26.7.5), which is good to four digits there.
fn t_quantile(freedom: usize) -> f64 {
    if let Some(t) = T.get(freedom - 1) {
        return *t;
    }
    let (z, f) = (Z, freedom as f64);
    let g1 = (z.powi(3) + z) / 4.0;
    let g2 = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let g3 = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    let g4 = (79.0 * z.powi(9) + 776.0 * z.powi(7) + 1482.0 * z.powi(5) - 1920.0 * z.powi(3) - 945.0 * z)
        / 92160.0;
    z + g1 / f + g2 / f.powi(2) + g3 / f.powi(3) + g4 / f.powi(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_tables() {
        // Student's t, 97.5 %: 19 and 60 degrees of freedom.
        assert!((t_quantile(19) - 2.0930).abs() < 1e-4 && (t_quantile(60) - 2.0003).abs() < 1e-4);
        assert!((t_quantile(11) - 2.2010).abs() < 1e-4, "{}", t_quantile(11));
        // 1, 2, 3, 4, 5: mean 3, deviation sqrt(2.5), half width 2.7764 sqrt(2.5 / 5).
        let [low, high] = mean_interval(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        assert!((low - 1.036_74).abs() < 1e-4 && (high - 4.963_26).abs() < 1e-4, "{low} {high}");
        // Wilson: 15 of 20, and 5 of 5.
        let [low, high] = rate_interval(15, 20).unwrap();
        assert!((low - 0.5313).abs() < 1e-4 && (high - 0.8881).abs() < 1e-4, "{low} {high}");
        let [low, high] = rate_interval(5, 5).unwrap();
        assert!((low - 0.5655).abs() < 1e-4 && high == 1.0, "{low} {high}");
        assert_eq!(rate_interval(0, 5).unwrap()[0], 0.0);
    }

    #[test]
    fn one_number_has_no_interval() {
        assert_eq!((mean(&[2.0]), deviation(&[2.0]), mean_interval(&[2.0])), (2.0, 0.0, None));
        assert!(mean(&[]).is_nan() && rate_interval(0, 0).is_none());
    }
}
