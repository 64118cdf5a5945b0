//! The spanning tree of a network simplex: who hangs on whom, with what flow, at what potential.
//!
//! A star of artificial arcs comes in; every pivot puts one arc into the tree and takes one out. The
//! rule for the arc that leaves keeps the tree strongly feasible, so pivots without flow cannot cycle
//! (Cunningham 1976, "A network simplex method"). Imports nothing.

/// Marks the end of a list of siblings.
const END: usize = usize::MAX;

/// A tree node with the arc that joins it to its parent.
#[derive(Clone)]
pub struct Node {
    pub parent: usize,
    /// Whether the arc runs from this node to its parent.
    pub upward: bool,
    /// Mass on the arc, not negative.
    pub flow: f64,
    /// Cost of a unit on the arc.
    pub cost: f64,
    /// Dual potential: for every tree arc from a to b, `cost + potential_a - potential_b = 0`.
    pub potential: f64,
    depth: usize,
    first_child: usize,
    next: usize,
    previous: usize,
}

/// A spanning tree with its root at the last node.
pub struct Tree {
    pub nodes: Vec<Node>,
}

impl Tree {
    /// A star: node k sends `surplus[k]` to the root, or gets it from there if it is negative, at
    /// `cost` a unit.
    pub fn star(surplus: &[f64], cost: f64) -> Self {
        let root = surplus.len();
        let leaf = |(k, &s): (usize, &f64)| Node {
            parent: root,
            upward: s >= 0.0,
            flow: s.abs(),
            cost,
            potential: if s >= 0.0 { -cost } else { cost },
            depth: 1,
            first_child: END,
            next: if k + 1 < root { k + 1 } else { END },
            previous: if k > 0 { k - 1 } else { END },
        };
        let mut nodes: Vec<Node> = surplus.iter().enumerate().map(leaf).collect();
        let top = Node {
            parent: END,
            upward: false,
            flow: 0.0,
            cost: 0.0,
            potential: 0.0,
            depth: 0,
            first_child: if root > 0 { 0 } else { END },
            next: END,
            previous: END,
        };
        nodes.push(top);
        Self { nodes }
    }

    /// Puts the arc from `tail` to `head` into the tree, sends as much along the ring it closes as
    /// the flows allow, and takes out the arc that ran dry.
    pub fn pivot(&mut self, tail: usize, head: usize, cost: f64) {
        let join = self.join(tail, head);
        let (flow, dry) = self.bottleneck(tail, head, join);
        self.push_around(tail, head, join, flow);
        // The part of the tree below the dry arc hangs on the new one from now on.
        let (inner, outer) = if dry.on_tail_side { (tail, head) } else { (head, tail) };
        let arc = Arc { upward: dry.on_tail_side, flow, cost };
        self.rehang(inner, outer, dry.node, arc);
        self.refresh(inner);
    }

    /// The lowest common ancestor.
    fn join(&self, mut a: usize, mut b: usize) -> usize {
        while a != b {
            if self.nodes[a].depth >= self.nodes[b].depth {
                a = self.nodes[a].parent;
            } else {
                b = self.nodes[b].parent;
            }
        }
        a
    }

    /// How much the ring can take, and the node whose arc to its parent runs dry first. Ties go to the
    /// last such arc seen from the join along the new arc, which keeps the tree strongly feasible.
    fn bottleneck(&self, tail: usize, head: usize, join: usize) -> (f64, Dry) {
        let mut least = f64::INFINITY;
        let mut dry = Dry { node: tail, on_tail_side: true };
        let mut node = tail;
        while node != join {
            if self.nodes[node].upward && self.nodes[node].flow < least {
                least = self.nodes[node].flow;
                dry = Dry { node, on_tail_side: true };
            }
            node = self.nodes[node].parent;
        }
        node = head;
        while node != join {
            if !self.nodes[node].upward && self.nodes[node].flow <= least {
                least = self.nodes[node].flow;
                dry = Dry { node, on_tail_side: false };
            }
            node = self.nodes[node].parent;
        }
        (least, dry)
    }

    fn push_around(&mut self, tail: usize, head: usize, join: usize, flow: f64) {
        for (start, gains) in [(tail, false), (head, true)] {
            let mut node = start;
            while node != join {
                let arc = &mut self.nodes[node];
                let change = if arc.upward == gains { flow } else { -flow };
                arc.flow = (arc.flow + change).max(0.0);
                node = arc.parent;
            }
        }
    }

    /// Hangs `inner` on `outer` by `arc`, turning around the arcs from `inner` up to `top`, whose own
    /// arc to its parent is dropped.
    fn rehang(&mut self, inner: usize, outer: usize, top: usize, mut arc: Arc) {
        let (mut node, mut parent) = (inner, outer);
        loop {
            self.unlink(node);
            let old = &mut self.nodes[node];
            let above = std::mem::replace(&mut old.parent, parent);
            let dropped = Arc { upward: !old.upward, flow: old.flow, cost: old.cost };
            (old.upward, old.flow, old.cost) = (arc.upward, arc.flow, arc.cost);
            self.link(node);
            if node == top {
                return;
            }
            (node, parent, arc) = (above, node, dropped);
        }
    }

    /// Takes a node off its parent's list of children.
    fn unlink(&mut self, node: usize) {
        let Node { parent, next, previous, .. } = self.nodes[node];
        if previous == END {
            self.nodes[parent].first_child = next;
        } else {
            self.nodes[previous].next = next;
        }
        if next != END {
            self.nodes[next].previous = previous;
        }
    }

    /// Puts a node on its parent's list of children.
    fn link(&mut self, node: usize) {
        let parent = self.nodes[node].parent;
        let next = std::mem::replace(&mut self.nodes[parent].first_child, node);
        (self.nodes[node].next, self.nodes[node].previous) = (next, END);
        if next != END {
            self.nodes[next].previous = node;
        }
    }

    /// Recomputes depth and potential of a node and all below it.
    fn refresh(&mut self, top: usize) {
        let mut waiting = vec![top];
        while let Some(k) = waiting.pop() {
            let Node { parent, upward, cost, .. } = self.nodes[k];
            let above = &self.nodes[parent];
            let (depth, potential) = (above.depth + 1, above.potential + if upward { -cost } else { cost });
            (self.nodes[k].depth, self.nodes[k].potential) = (depth, potential);
            let mut child = self.nodes[k].first_child;
            while child != END {
                waiting.push(child);
                child = self.nodes[child].next;
            }
        }
    }
}

/// The arc that leaves: from `node` to its parent, on the way from the new arc's tail or head to the join.
struct Dry {
    node: usize,
    on_tail_side: bool,
}

struct Arc {
    upward: bool,
    flow: f64,
    cost: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pivot_moves_flow_and_keeps_the_tree_whole() {
        // Two sources with 1 each, two targets that want 1 each.
        let mut tree = Tree::star(&[1.0, 1.0, -1.0, -1.0], 10.0);
        for (tail, head) in [(0, 2), (1, 3), (1, 2)] {
            tree.pivot(tail, head, 1.0 + tail as f64);
            for node in &tree.nodes[..4] {
                let (above, own) = (tree.nodes[node.parent].potential, node.potential);
                let reduced = node.cost + if node.upward { own - above } else { above - own };
                assert_eq!(reduced, 0.0);
                assert_eq!(node.depth, tree.nodes[node.parent].depth + 1);
            }
        }
        let artificial: f64 = tree.nodes[..4].iter().filter(|n| n.parent == 4).map(|n| n.flow).sum();
        assert_eq!(artificial, 0.0);
    }
}
