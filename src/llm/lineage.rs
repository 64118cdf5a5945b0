//! What the names in a plan mean: which pieces are alive at a stage, and which of them it takes.
//!
//! Names as an answer writes them come in; piece numbers go out, or an error that names the step, the name
//! and the live pieces. Imports `stage`.

use super::stage::{NamedCloud, Stage};

/// A name that stands for no piece.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "step {step} takes `{name}`, {}; the pieces at that point are {live}: correct the name in the answer",
    match .used_by {
        Some(used) => format!("which step {used} has used up"),
        None => "which no step before it made".to_owned(),
    }
)]
pub struct UnknownPiece {
    /// The step that names it.
    pub step: u32,
    /// The name.
    pub name: String,
    /// The live pieces, in backticks.
    pub live: String,
    /// The step that took the piece of that name, if there was one.
    pub used_by: Option<u32>,
}

/// The pieces that exist between two stages, oldest first.
pub struct LivePieces {
    live: Vec<(usize, String)>,
    /// Names of pieces that are no more, and the step that took each.
    used: Vec<(String, u32)>,
}

impl LivePieces {
    /// Before the first stage: only the initial dough, number 0, whatever the plan will call it.
    pub fn initial(name: &str) -> Self {
        Self { live: vec![(0, name.to_string())], used: Vec::new() }
    }

    /// The pieces that a stage takes, given the names it writes. A name that nobody made means the only live
    /// piece if there is just one; so the first stage may call the initial dough what it likes.
    pub fn take(&mut self, step: u32, names: &[String]) -> Result<Vec<usize>, UnknownPiece> {
        let mut taken: Vec<usize> = Vec::new();
        if names.is_empty() {
            taken.push(self.only_one(step, "no name")?);
        }
        for name in names {
            let id = match self.named(name) {
                Some(id) => id,
                None => self.only_one(step, name)?,
            };
            if !taken.contains(&id) {
                taken.push(id);
            }
        }
        let (gone, live) = std::mem::take(&mut self.live).into_iter().partition(|(id, _)| taken.contains(id));
        self.live = live;
        self.used.extend(gone.into_iter().map(|(_, name)| (name, step)));
        Ok(taken)
    }

    /// A stage made this piece.
    pub fn add(&mut self, id: usize, name: &str) {
        self.live.push((id, name.to_string()));
    }

    /// Numbers of the live pieces.
    pub fn ids(&self) -> Vec<usize> {
        self.live.iter().map(|(id, _)| *id).collect()
    }

    /// The latest live piece of that name: plans use names again, like variables.
    pub fn named(&self, name: &str) -> Option<usize> {
        self.live.iter().rev().find(|(_, n)| n == name).map(|(id, _)| *id)
    }

    /// Why `name` stands for no live piece.
    pub fn unknown(&self, step: u32, name: &str) -> UnknownPiece {
        UnknownPiece {
            step,
            name: name.to_string(),
            live: self.live.iter().map(|(_, n)| format!("`{n}`")).collect::<Vec<_>>().join(", "),
            used_by: self.used.iter().rev().find(|(used, _)| used == name).map(|(_, step)| *step),
        }
    }

    fn only_one(&self, step: u32, name: &str) -> Result<usize, UnknownPiece> {
        match &self.live[..] {
            [(id, _)] => Ok(*id),
            _ => Err(self.unknown(step, name)),
        }
    }
}

/// The clouds that exist when all stages are done, oldest first. Steps without a tool before the first with one
/// only build the initial dough.
pub fn last_clouds(stages: &[Stage]) -> Result<Vec<&NamedCloud>, UnknownPiece> {
    let first = stages.iter().position(|s| s.tool.is_some()).unwrap_or(stages.len());
    let dough = stages[..first].iter().flat_map(|s| &s.outputs).next_back();
    let mut clouds: Vec<Option<&NamedCloud>> = vec![dough];
    let mut live = LivePieces::initial(dough.map_or("dough", |cloud| cloud.name.as_str()));
    for stage in &stages[first..] {
        live.take(stage.step, &stage.inputs)?;
        for cloud in &stage.outputs {
            // A piece that the stage lists though it neither takes nor changes it stays what it is.
            if live.named(&cloud.name).is_some_and(|id| clouds[id].is_some_and(|c| c.points == cloud.points))
            {
                continue;
            }
            live.add(clouds.len(), &cloud.name);
            clouds.push(Some(cloud));
        }
    }
    Ok(live.ids().into_iter().filter_map(|id| clouds[id]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn pieces_are_followed_and_a_used_one_says_so() {
        let mut live = LivePieces::initial("bar");
        assert_eq!(live.take(1, &names(&["dough"])), Ok(vec![0]), "the only piece may be called anything");
        live.add(1, "left");
        live.add(2, "right");
        assert_eq!(live.take(2, &names(&["left"])), Ok(vec![1]));
        live.add(3, "pancake");
        let again = live.take(3, &names(&["left"])).unwrap_err();
        assert_eq!(again.used_by, Some(2));
        assert_eq!(
            again.to_string(),
            "step 3 takes `left`, which step 2 has used up; the pieces at that point are `right`, `pancake`: \
             correct the name in the answer"
        );
        let never = live.take(3, &names(&["lft"])).unwrap_err().to_string();
        assert!(never.contains("which no step before it made"), "{never}");
        assert_eq!(live.ids(), [2, 3]);
    }
}
