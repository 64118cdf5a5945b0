//! What the names in a plan mean: which pieces are alive at a stage, and which of them it takes.
//!
//! Names as an answer writes them come in; piece ids go out, or an error that names the step, the name and
//! the live pieces. Imports this module's pieces and errors.

use super::error::StageError;
use super::pieces::PieceId;

/// The pieces that exist between two stages, oldest first.
pub struct LivePieces {
    live: Vec<(PieceId, String)>,
}

impl LivePieces {
    /// Before the first stage: only the initial dough, whatever the plan will call it.
    pub fn initial(name: &str) -> Self {
        Self { live: vec![(0, name.to_string())] }
    }

    /// The pieces that a stage takes, given the names it writes. A name that nobody made means the only live
    /// piece if there is just one; so the first stage may call the initial dough what it likes.
    pub fn take(&mut self, step: u32, names: &[String]) -> Result<Vec<PieceId>, StageError> {
        let mut taken: Vec<PieceId> = Vec::new();
        if names.is_empty() {
            taken.push(self.only_one(step, "no name")?);
        }
        for name in names {
            // The latest piece of that name: plans use names again, like variables.
            let known = self.live.iter().rev().find(|(_, n)| n == name).map(|(id, _)| *id);
            let id = match known {
                Some(id) => id,
                None => self.only_one(step, name)?,
            };
            if !taken.contains(&id) {
                taken.push(id);
            }
        }
        self.live.retain(|(id, _)| !taken.contains(id));
        Ok(taken)
    }

    /// A stage made this piece.
    pub fn add(&mut self, id: PieceId, name: &str) {
        self.live.push((id, name.to_string()));
    }

    /// Ids of the live pieces.
    pub fn ids(&self) -> Vec<PieceId> {
        self.live.iter().map(|(id, _)| *id).collect()
    }

    fn only_one(&self, step: u32, name: &str) -> Result<PieceId, StageError> {
        match &self.live[..] {
            [(id, _)] => Ok(*id),
            _ => Err(StageError::UnknownPiece {
                step,
                name: name.to_string(),
                live: self.live.iter().map(|(_, n)| format!("`{n}`")).collect::<Vec<_>>().join(", "),
            }),
        }
    }
}
