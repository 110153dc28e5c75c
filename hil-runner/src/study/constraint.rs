//! Points that a study leaves out: `controller.computation_delay_s <=
//! 0.5 * controller.sample_time_s`.

use core::fmt;

use hil_core::runfile::KeyPath;

/// A relation of two terms that must hold for a point to be run.
#[derive(Debug, Clone)]
pub struct Constraint {
    left: Term,
    relation: Relation,
    right: Term,
    text: String,
}

/// A number, a key, or a number times a key.
#[derive(Debug, Clone)]
struct Term {
    factor: f64,
    key: Option<KeyPath>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Relation {
    Less,
    AtMost,
    Greater,
    AtLeast,
}

impl fmt::Display for Constraint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Constraint {
    /// Reads `TERM < TERM`, with `<`, `<=`, `>` or `>=`; a term is a number, a
    /// key, or `NUMBER * KEY`.
    ///
    /// # Errors
    /// The sentence that says what is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        let relations = [
            ("<=", Relation::AtMost),
            (">=", Relation::AtLeast),
            ("<", Relation::Less),
            (">", Relation::Greater),
        ];
        let split = relations.iter().find_map(|(sign, relation)| {
            let (left, right) = text.split_once(sign)?;
            Some((left, *relation, right))
        });
        let Some((left, relation, right)) = split else {
            return Err("there is no <, <=, > or >= between two terms".to_owned());
        };
        Ok(Self {
            left: Term::parse(left)?,
            relation,
            right: Term::parse(right)?,
            text: text.split_whitespace().collect::<Vec<_>>().join(" "),
        })
    }

    /// Whether it holds where `number` gives the values of keys; a key without
    /// a number fails.
    pub fn holds(&self, number: impl Fn(&KeyPath) -> Option<f64>) -> bool {
        let (Some(left), Some(right)) = (self.left.value(&number), self.right.value(&number))
        else {
            return false;
        };
        match self.relation {
            Relation::Less => left < right,
            Relation::AtMost => left <= right,
            Relation::Greater => left > right,
            Relation::AtLeast => left >= right,
        }
    }

    /// The keys that it names.
    pub fn keys(&self) -> impl Iterator<Item = &KeyPath> {
        [&self.left, &self.right]
            .into_iter()
            .filter_map(|term| term.key.as_ref())
    }
}

impl Term {
    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let (factor, rest) = match text.split_once('*') {
            Some((factor, key)) => (factor.trim(), Some(key.trim())),
            None if text.parse::<f64>().is_ok() => (text, None),
            None => ("1", Some(text)),
        };
        let factor: f64 = factor
            .parse()
            .ok()
            .filter(|factor: &f64| factor.is_finite())
            .ok_or_else(|| format!("{factor:?} is no number; write NUMBER * KEY"))?;
        let key = rest.map(KeyPath::find).transpose()?;
        Ok(Self { factor, key })
    }

    fn value(&self, number: impl Fn(&KeyPath) -> Option<f64>) -> Option<f64> {
        match &self.key {
            None => Some(self.factor),
            Some(key) => Some(self.factor * number(key)?),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relations_hold_as_they_read() {
        let holds = |text: &str| {
            let constraint = Constraint::parse(text).unwrap();
            constraint.holds(|key| match key.path().as_str() {
                "controller.kp" => Some(2.0),
                "controller.sample_time_s" => Some(1e-3),
                _ => None,
            })
        };
        assert!(holds("controller.kp <= 2"));
        assert!(!holds("controller.kp < 2"));
        assert!(holds("controller.kp>=2e3*controller.sample_time_s"));
        assert!(!holds("0.001 > controller.sample_time_s"));
        assert!(!holds("controller.kd_s > 0"), "what is not known fails");
    }

    #[test]
    fn nonsense_is_refused_with_a_sentence() {
        for (text, words) in [
            ("controller.kp", "there is no <"),
            ("controller.kpp < 3", "unknown key controller.kpp"),
            ("x * controller.kp < 3", "\"x\" is no number"),
            ("inf < controller.kp", "\"inf\" is no number"),
        ] {
            let error = Constraint::parse(text).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
