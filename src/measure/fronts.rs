//! Error against run time: which settings are worth having, and who has the lower error at equal time.
//! Less is better in both. Points without a figure, or with one that is not finite, are left out before.

use serde::Serialize;

/// One setting of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// What it costs: milliseconds, triangles or bytes, the same for all points compared.
    pub cost: f64,
    /// Its error, pixels.
    pub error: f64,
}

impl Point {
    fn dominates(self, other: Self) -> bool {
        let no_worse = self.cost <= other.cost && self.error <= other.error;
        no_worse && (self.cost < other.cost || self.error < other.error)
    }
}

/// Whether another point is no worse in both and better in one; equal points do not dominate each other.
#[must_use]
pub fn dominated(points: &[Point]) -> Vec<bool> {
    points.iter().map(|p| points.iter().any(|other| other.dominates(*p))).collect()
}

/// The outer front over all methods, as (method, point), by cost; of equal points all are in it.
#[must_use]
pub fn union(fronts: &[Vec<Point>]) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    for (method, points) in fronts.iter().enumerate() {
        all.extend(points.iter().enumerate().map(|(ix, point)| (method, ix, *point)));
    }
    let points: Vec<Point> = all.iter().map(|(_, _, point)| *point).collect();
    let mut outer: Vec<_> =
        all.into_iter().zip(dominated(&points)).filter(|(_, out)| !out).map(|(at, _)| at).collect();
    outer.sort_by(|a, b| a.2.cost.total_cmp(&b.2.cost));
    outer.into_iter().map(|(method, ix, _)| (method, ix)).collect()
}

/// Least error of the points that cost no more than `cost`: a staircase, since nothing is known between two
/// settings. `None` where all cost more.
#[must_use]
pub fn best_error_within(front: &[Point], cost: f64) -> Option<f64> {
    front.iter().filter(|p| p.cost <= cost).map(|p| p.error).reduce(f64::min)
}

/// At how many of a rival's settings ours has the lower error for no higher cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Won {
    /// Settings of the rival at which ours has the lower error; an equal error is not won.
    pub won: usize,
    /// Settings at which that depends on differences of cost within the noise.
    pub undecided: usize,
    /// Settings of the rival.
    pub of: usize,
    /// Those of them that cost less than any of ours; they count as lost.
    pub out_of_reach: usize,
}

/// What a setting of a rival comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Ours has the lower error for no higher cost, whatever the noise.
    Won,
    /// It depends on differences of cost within the noise.
    Undecided,
    /// Ours has no lower error at that cost.
    Lost,
    /// All of ours cost more, whatever the noise.
    OutOfReach,
}

/// Compares ours with one point of a rival; costs within a share `noise` of each other may be equal.
#[must_use]
pub fn against(ours: &[Point], rival: Point, noise: f64) -> Against {
    let lower = |cost: f64| best_error_within(ours, cost).map(|error| error < rival.error);
    match (lower(rival.cost / (1.0 + noise)), lower(rival.cost * (1.0 + noise))) {
        (Some(true), _) => Against::Won,
        (_, Some(true)) => Against::Undecided,
        (_, None) => Against::OutOfReach,
        _ => Against::Lost,
    }
}

/// Compares at each of the rival's points; `None` when one of the two has none.
#[must_use]
pub fn share_won(ours: &[Point], rival: &[Point], noise: f64) -> Option<Won> {
    if ours.is_empty() || rival.is_empty() {
        return None;
    }
    let count = |which| rival.iter().filter(|p| against(ours, **p, noise) == which).count();
    Some(Won {
        won: count(Against::Won),
        undecided: count(Against::Undecided),
        of: rival.len(),
        out_of_reach: count(Against::OutOfReach),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(of: &[(f64, f64)]) -> Vec<Point> {
        of.iter().map(|&(cost, error)| Point { cost, error }).collect()
    }

    #[test]
    fn a_point_is_dominated_by_one_no_worse_in_both_and_better_in_one() {
        assert_eq!(dominated(&points(&[(1.0, 3.0), (2.0, 2.0), (3.0, 1.0)])), [false; 3]);
        assert_eq!(dominated(&points(&[(1.0, 1.0), (2.0, 2.0), (1.0, 1.5)])), [false, true, true]);
        assert_eq!(dominated(&points(&[(1.0, 1.0), (1.0, 1.0)])), [false, false]);
        assert_eq!(dominated(&[]), Vec::<bool>::new());
    }

    #[test]
    fn the_outer_front_takes_from_every_method_and_is_sorted_by_cost() {
        let a = points(&[(5.0, 1.0), (2.0, 4.0)]);
        let b = points(&[(3.0, 2.0), (6.0, 1.0), (1.0, 9.0)]);
        // (6, 1) of b is dominated by (5, 1) of a, though not by any of its own.
        assert_eq!(dominated(&b), [false; 3]);
        assert_eq!(union(&[a, b]), [(1, 2), (0, 1), (1, 0), (0, 0)]);
        assert!(union(&[vec![], vec![]]).is_empty());
        let same = points(&[(1.0, 1.0)]);
        assert_eq!(union(&[same.clone(), same]), [(0, 0), (1, 0)]);
    }

    #[test]
    fn within_a_cost_the_best_error_is_a_staircase() {
        let front = points(&[(2.0, 4.0), (4.0, 1.0), (3.0, 5.0)]);
        assert_eq!(best_error_within(&front, 1.9), None);
        assert_eq!(best_error_within(&front, 2.0), Some(4.0));
        assert_eq!(best_error_within(&front, 3.9), Some(4.0));
        assert_eq!(best_error_within(&front, 4.0), Some(1.0));
    }

    #[test]
    fn points_cheaper_than_any_of_ours_and_equal_errors_are_lost() {
        let ours = points(&[(2.0, 4.0), (4.0, 1.0)]);
        let rival = points(&[(1.0, 9.0), (2.5, 4.0), (3.0, 5.0), (4.0, 0.5), (8.0, 1.5)]);
        let won = |won, of, out_of_reach| Some(Won { won, undecided: 0, of, out_of_reach });
        assert_eq!(share_won(&ours, &rival, 0.0), won(2, 5, 1));
        assert_eq!(share_won(&rival, &ours, 0.0), won(1, 2, 0));
        assert_eq!(share_won(&ours, &[], 0.0), None);
        assert_eq!(share_won(&[], &rival, 0.0), None);
    }

    #[test]
    fn what_hangs_on_a_difference_within_the_noise_is_undecided() {
        let ours = points(&[(2.0, 4.0), (4.0, 1.0)]);
        let at = |cost, error, noise| against(&ours, Point { cost, error }, noise);
        assert_eq!(at(3.9, 2.0, 0.0), Against::Lost);
        assert_eq!(at(3.9, 2.0, 0.1), Against::Undecided);
        assert_eq!(at(4.1, 2.0, 0.0), Against::Won);
        assert_eq!(at(4.1, 2.0, 0.1), Against::Undecided);
        assert_eq!(at(5.0, 2.0, 0.1), Against::Won);
        assert_eq!(at(1.9, 9.0, 0.1), Against::Undecided);
        assert_eq!(at(1.0, 9.0, 0.1), Against::OutOfReach);
        assert_eq!(at(9.0, 0.5, 0.1), Against::Lost);
    }
}
