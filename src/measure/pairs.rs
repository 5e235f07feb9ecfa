//! Methods measured in turn, and what may be said of their differences. No clock in here: flights come from
//! a [`Measurer`], so that all of it is tested without one.

use serde::Serialize;

use super::percentile;

/// Fewest undisturbed rounds a verdict needs.
pub const LEAST_PAIRS: usize = 5;
/// How many times the spread of A against A a difference must exceed.
pub const NOISE_FACTOR: f64 = 3.0;
/// A round whose A against A deviates by no more than this is never disturbed; 1 is 100 %.
pub const QUIET: f64 = 0.10;

/// One flight to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turn {
    /// Which case: a method with its detail.
    pub case: usize,
    /// Round from 0.
    pub round: usize,
}

/// All flights in the order they are flown: A B C, C B A, A B C, ... so that a machine that drifts hurts
/// every case alike.
#[must_use]
pub fn order(cases: usize, rounds: usize) -> Vec<Turn> {
    (0..rounds)
        .flat_map(|round| {
            (0..cases).map(move |k| Turn { case: if round % 2 == 0 { k } else { cases - 1 - k }, round })
        })
        .collect()
}

/// What flies.
pub trait Measurer {
    /// Why a flight failed.
    type Error;

    /// Frame times of one flight in milliseconds, in the order they were drawn.
    ///
    /// # Errors
    /// When the flight cannot be flown.
    fn flight(&mut self, turn: Turn) -> Result<Vec<f64>, Self::Error>;
}

/// Frame times in milliseconds as `[case][round][frame]`, measured in the order of [`order`].
///
/// # Errors
/// The first one of the measurer's; nothing is measured after it.
pub fn measure<M: Measurer>(
    cases: usize,
    rounds: usize,
    measurer: &mut M,
) -> Result<Vec<Vec<Vec<f64>>>, M::Error> {
    let mut times = vec![vec![Vec::new(); rounds]; cases];
    for turn in order(cases, rounds) {
        times[turn.case][turn.round] = measurer.flight(turn)?;
    }
    Ok(times)
}

/// Median of samples in any order; numbers that are not finite are left out. `None` when nothing is left.
#[must_use]
pub fn median(samples: &[f64]) -> Option<f64> {
    let mut sorted: Vec<f64> = samples.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    percentile(&sorted, 0.5)
}

/// Median of each round, as [`Noise::of`] and [`judge`] take them; a round without frames is NaN and in no
/// ratio.
#[must_use]
pub fn medians(rounds: &[Vec<f64>]) -> Vec<f64> {
    rounds.iter().map(|frames| median(frames).unwrap_or(f64::NAN)).collect()
}

/// How far the baseline is from itself: it is measured twice, as two cases, and their ratios ought to be 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Noise {
    /// Largest |a2 / a1 - 1| of the rounds kept; 1 is 100 %, best 0.
    pub spread: f64,
    /// Rounds that count.
    pub rounds_kept: usize,
    /// Rounds left out of every method's ratios, from 0: they deviate by more than 0.10 and by more than
    /// three times the median deviation of all rounds, or have no ratio. Their frames stay in the raw
    /// samples and in the pooled statistics.
    pub disturbed: Vec<usize>,
}

impl Noise {
    /// Of the baseline's medians (or another statistic), one a round, from its two cases.
    #[must_use]
    pub fn of(first: &[f64], second: &[f64]) -> Self {
        let deviations = deviations(first, second);
        let known: Vec<f64> = deviations.iter().copied().flatten().collect();
        let usual = median(&known).unwrap_or(0.0);
        let is_disturbed = |d: Option<f64>| d.is_none_or(|d| d > QUIET && d > NOISE_FACTOR * usual);
        let disturbed: Vec<usize> =
            (0..deviations.len()).filter(|&round| is_disturbed(deviations[round])).collect();
        Self::without(&deviations, disturbed)
    }

    /// Of another statistic of the same flights: the rounds left out stay those of `self`.
    #[must_use]
    pub fn again(&self, first: &[f64], second: &[f64]) -> Self {
        Self::without(&deviations(first, second), self.disturbed.clone())
    }

    fn without(deviations: &[Option<f64>], disturbed: Vec<usize>) -> Self {
        let kept: Vec<f64> =
            (0..deviations.len()).filter(|r| !disturbed.contains(r)).filter_map(|r| deviations[r]).collect();
        Self { spread: kept.iter().copied().fold(0.0, f64::max), rounds_kept: kept.len(), disturbed }
    }
}

/// What may be said of a method against the baseline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Less than the baseline by more than three times the noise.
    Faster,
    /// More than the baseline by more than three times the noise.
    Slower,
    /// Within three times the noise.
    NoDifference,
    /// Fewer than five undisturbed rounds: nothing can be said.
    TooFewPairs,
}

/// A method against the baseline, round by round.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Ratio {
    /// Median over the rounds kept of method / baseline; below 1 the method is faster.
    pub ratio: f64,
    /// Least of these rounds.
    pub low: f64,
    /// Greatest of these rounds.
    pub high: f64,
    /// Spread of A against A, as in [`Noise::spread`].
    pub noise: f64,
    /// Rounds it rests on.
    pub pairs: usize,
    /// What may be said.
    pub verdict: Verdict,
}

/// Judges a method by its medians, one a round, against the baseline's of the same rounds; `None` when no
/// undisturbed round has both.
#[must_use]
pub fn judge(method_rounds: &[f64], baseline: &[f64], noise: &Noise) -> Option<Ratio> {
    let ratios: Vec<f64> = method_rounds
        .iter()
        .zip(baseline)
        .enumerate()
        .filter(|(round, _)| !noise.disturbed.contains(round))
        .filter_map(|(_, (method, baseline))| ratio(method, baseline))
        .collect();
    let middle = median(&ratios)?;
    let verdict = if ratios.len().min(noise.rounds_kept) < LEAST_PAIRS {
        Verdict::TooFewPairs
    } else if (middle - 1.0).abs() <= NOISE_FACTOR * noise.spread {
        Verdict::NoDifference
    } else if middle < 1.0 {
        Verdict::Faster
    } else if middle > 1.0 {
        Verdict::Slower
    } else {
        Verdict::NoDifference
    };
    Some(Ratio {
        ratio: middle,
        low: ratios.iter().copied().fold(f64::INFINITY, f64::min),
        high: ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        noise: noise.spread,
        pairs: ratios.len(),
        verdict,
    })
}

/// Judges by another statistic of a round's frames than the median, against its own A against A; rounds
/// that `noise` (of the medians) calls disturbed are left out here too. Frame times as `[round][frame]`.
#[must_use]
pub fn judge_by(
    method: &[Vec<f64>],
    baseline: [&[Vec<f64>]; 2],
    noise: &Noise,
    statistic: impl Fn(&[f64]) -> Option<f64>,
) -> Option<Ratio> {
    let of = |rounds: &[Vec<f64>]| -> Vec<f64> {
        rounds.iter().map(|frames| statistic(frames).unwrap_or(f64::NAN)).collect()
    };
    let [first, second] = baseline.map(of);
    judge(&of(method), &first, &noise.again(&first, &second))
}

/// |second / first - 1| of each round; `None` where one of the two is missing.
fn deviations(first: &[f64], second: &[f64]) -> Vec<Option<f64>> {
    (0..first.len().max(second.len()))
        .map(|round| Some((ratio(second.get(round)?, first.get(round)?)? - 1.0).abs()))
        .collect()
}

/// A ratio of two times; none where one is missing or not above zero.
fn ratio(of: &f64, to: &f64) -> Option<f64> {
    let usable = |v: &f64| v.is_finite() && *v > 0.0;
    (usable(of) && usable(to)).then(|| of / to)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    #[test]
    fn rounds_are_flown_there_and_back() {
        let cases: Vec<usize> = order(3, 3).iter().map(|t| t.case).collect();
        assert_eq!(cases, [0, 1, 2, 2, 1, 0, 0, 1, 2]);
        let rounds: Vec<usize> = order(3, 3).iter().map(|t| t.round).collect();
        assert_eq!(rounds, [0, 0, 0, 1, 1, 1, 2, 2, 2]);
        assert!(order(0, 5).is_empty() && order(5, 0).is_empty());
    }

    /// A machine that is one per cent slower with every flight.
    struct Drifting {
        flights: u32,
    }

    impl Measurer for Drifting {
        type Error = Infallible;

        fn flight(&mut self, _: Turn) -> Result<Vec<f64>, Infallible> {
            let time = 10.0 * (1.0 + 0.01 * f64::from(self.flights));
            self.flights += 1;
            Ok(vec![time; 3])
        }
    }

    #[test]
    fn a_drifting_machine_makes_no_difference_in_turn_and_one_in_a_row() {
        let times = measure(3, 6, &mut Drifting { flights: 0 }).unwrap();
        assert_eq!(times.len(), 3);
        assert!(times.iter().all(|rounds| rounds.len() == 6 && rounds.iter().all(|f| f.len() == 3)));
        let [a1, a2, b] = [0, 1, 2].map(|case: usize| medians(&times[case]));
        let noise = Noise::of(&a1, &a2);
        let ratio = judge(&b, &a1, &noise).unwrap();
        assert!((ratio.ratio - 1.0).abs() < 0.01, "{ratio:?}");
        assert_eq!(ratio.verdict, Verdict::NoDifference);
        // The same machine, first all flights of A and then all of B.
        let mut machine = Drifting { flights: 0 };
        let mut flown = |rounds| (0..rounds).map(|_| machine.flights_of_one()).collect::<Vec<f64>>();
        let (all_a, all_b) = (flown(6), flown(6));
        let quiet = Noise { spread: 0.01, rounds_kept: 6, disturbed: vec![] };
        assert_eq!(judge(&all_b, &all_a, &quiet).unwrap().verdict, Verdict::Slower);
    }

    impl Drifting {
        fn flights_of_one(&mut self) -> f64 {
            self.flight(Turn { case: 0, round: 0 }).map(|f| f[0]).unwrap_or_default()
        }
    }

    #[test]
    fn an_error_ends_the_measuring() {
        struct Failing(usize);
        impl Measurer for Failing {
            type Error = &'static str;
            fn flight(&mut self, _: Turn) -> Result<Vec<f64>, &'static str> {
                self.0 += 1;
                if self.0 == 3 { Err("lost") } else { Ok(vec![1.0]) }
            }
        }
        let mut failing = Failing(0);
        assert_eq!(measure(2, 5, &mut failing), Err("lost"));
        assert_eq!(failing.0, 3);
    }

    /// Something else ran in the fourth round while the baseline flew its second time.
    struct Disturbed;

    impl Measurer for Disturbed {
        type Error = Infallible;

        fn flight(&mut self, turn: Turn) -> Result<Vec<f64>, Infallible> {
            let time = [10.0, 10.1, 8.0][turn.case];
            let slow = if turn.round == 3 && turn.case > 0 { 2.0 } else { 1.0 };
            Ok(vec![time * slow, time * slow, 100.0 * time])
        }
    }

    #[test]
    fn a_disturbed_round_is_left_out_and_counted() {
        let times = measure(3, 7, &mut Disturbed).unwrap();
        let [a1, a2, b] = [0, 1, 2].map(|case: usize| medians(&times[case]));
        let noise = Noise::of(&a1, &a2);
        assert_eq!(noise.disturbed, [3]);
        assert_eq!(noise.rounds_kept, 6);
        assert!((noise.spread - 0.01).abs() < 1e-9);
        let ratio = judge(&b, &a1, &noise).unwrap();
        assert_eq!((ratio.pairs, ratio.verdict), (6, Verdict::Faster));
        // With the disturbed round the greatest ratio would be 1.6.
        assert!((ratio.high - 0.8).abs() < 1e-9 && (ratio.low - 0.8).abs() < 1e-9);
        // The frames of that round are still there.
        assert_eq!(times[2][3].len(), 3);
    }

    #[test]
    fn a_round_is_disturbed_only_beyond_both_bounds() {
        // Beyond three times the usual deviation, but not beyond 0.10: a quiet machine.
        let ones = vec![1.0; 6];
        let quiet = Noise::of(&ones, &[1.0, 1.01, 1.0, 1.09, 1.01, 1.0]);
        assert_eq!(quiet.disturbed, Vec::<usize>::new());
        assert!((quiet.spread - 0.09).abs() < 1e-9);
        // Beyond 0.10, but usual: a restless machine keeps its rounds and its wide spread.
        let restless = Noise::of(&ones, &[1.15, 0.8, 1.2, 0.85, 1.1, 1.3]);
        assert_eq!(restless.rounds_kept, 6);
        assert!((restless.spread - 0.3).abs() < 1e-9);
        // A round without a figure has no ratio.
        assert_eq!(Noise::of(&[1.0, f64::NAN, 1.0], &[1.0, 1.0]).disturbed, [1, 2]);
    }

    fn with_spread(spread: f64, rounds_kept: usize) -> Noise {
        Noise { spread, rounds_kept, disturbed: vec![] }
    }

    #[test]
    fn faster_only_beyond_three_times_the_noise() {
        let ones = vec![1.0; 6];
        let verdict = |v: f64, spread| judge(&[v; 6], &ones, &with_spread(spread, 6)).unwrap().verdict;
        assert_eq!(verdict(0.9, 0.03), Verdict::Faster);
        assert_eq!(verdict(0.9, 0.034), Verdict::NoDifference);
        assert_eq!(verdict(1.25, 0.08), Verdict::Slower);
        assert_eq!(verdict(1.25, 0.09), Verdict::NoDifference);
        // 0.25 is exact: at three times the noise there is still no difference.
        assert_eq!(verdict(1.75, 0.25), Verdict::NoDifference);
        assert_eq!(verdict(1.0, 0.0), Verdict::NoDifference);
    }

    #[test]
    fn four_rounds_are_too_few() {
        let judged = |rounds: usize| {
            judge(&vec![0.5; rounds], &vec![1.0; rounds], &with_spread(0.0, rounds)).unwrap().verdict
        };
        assert_eq!(judged(4), Verdict::TooFewPairs);
        assert_eq!(judged(5), Verdict::Faster);
        // The noise must rest on as many.
        let short = judge(&[0.5; 6], &[1.0; 6], &with_spread(0.0, 4)).unwrap();
        assert_eq!(short.verdict, Verdict::TooFewPairs);
        assert_eq!(judge(&[], &[], &with_spread(0.0, 0)), None);
        assert_eq!(judge(&[0.0, f64::NAN], &[1.0, 1.0], &with_spread(0.0, 2)), None);
    }

    #[test]
    fn another_statistic_has_its_own_noise() {
        let longest = |frames: &[f64]| frames.iter().copied().reduce(f64::max);
        let flown = |longest: f64| vec![vec![1.0, 1.0, longest]; 6];
        let (first, again, method) = (flown(2.0), flown(2.4), flown(1.0));
        let noise = Noise::of(&medians(&first), &medians(&again));
        assert!(noise.spread.abs() < 1e-9);
        let ratio = judge_by(&method, [&first[..], &again[..]], &noise, longest).unwrap();
        assert!((ratio.noise - 0.2).abs() < 1e-9);
        assert_eq!((ratio.ratio, ratio.verdict), (0.5, Verdict::NoDifference));
        let steady = judge_by(&method, [&first[..], &first[..]], &noise, longest).unwrap();
        assert_eq!(steady.verdict, Verdict::Faster);
    }

    #[test]
    fn verdicts_are_written_as_words() {
        let written = |v| serde_json::to_value(v).unwrap();
        assert_eq!(written(Verdict::Faster), "faster");
        assert_eq!(written(Verdict::TooFewPairs), "too-few-pairs");
    }
}
