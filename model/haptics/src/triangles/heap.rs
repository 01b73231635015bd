//! A heap of vertices by distance in which a vertex is once (binary heap: Williams, "Heapsort", Commun. ACM 7 (1964) 347-348).

use super::geodesic::Vertex;

/// Not in the heap.
pub(super) const OUT: u32 = u32::MAX;

#[derive(Clone, Debug)]
pub(super) struct VertexHeap {
    /// Distances and vertices, filled up to `count`; as long as there are vertices, so that it never grows.
    heap: Box<[(f64, u32)]>,
    count: usize,
}

impl VertexHeap {
    pub(super) fn new(vertices: usize) -> Self {
        Self { heap: vec![(0.0, 0); vertices].into(), count: 0 }
    }

    pub(super) fn clear(&mut self, vertices: &mut [Vertex]) {
        for (_, vertex) in &self.heap[..self.count] {
            vertices[*vertex as usize].place = OUT;
        }
        self.count = 0;
    }

    /// Puts a vertex in or moves it up, after its distance fell.
    pub(super) fn raise(&mut self, vertices: &mut [Vertex], vertex: u32, distance: f64) {
        let place = vertices[vertex as usize].place;
        let mut at = place as usize;
        if place == OUT {
            at = self.count;
            self.count += 1;
        }
        while at > 0 {
            let parent = (at - 1) / 2;
            let other = self.heap[parent];
            if other.0 <= distance {
                break;
            }
            self.set(vertices, at, other);
            at = parent;
        }
        self.set(vertices, at, (distance, vertex));
    }

    /// Takes the nearest out.
    pub(super) fn pop(&mut self, vertices: &mut [Vertex]) -> Option<u32> {
        if self.count == 0 {
            return None;
        }
        let (_, nearest) = self.heap[0];
        vertices[nearest as usize].place = OUT;
        self.count -= 1;
        if self.count > 0 {
            self.sink(vertices, self.heap[self.count]);
        }
        Some(nearest)
    }

    /// Puts a vertex at the top and lets it down.
    fn sink(&mut self, vertices: &mut [Vertex], one: (f64, u32)) {
        let mut at = 0;
        loop {
            let mut child = 2 * at + 1;
            if child >= self.count {
                break;
            }
            if child + 1 < self.count && self.heap[child + 1].0 < self.heap[child].0 {
                child += 1;
            }
            if one.0 <= self.heap[child].0 {
                break;
            }
            self.set(vertices, at, self.heap[child]);
            at = child;
        }
        self.set(vertices, at, one);
    }

    fn set(&mut self, vertices: &mut [Vertex], at: usize, one: (f64, u32)) {
        self.heap[at] = one;
        vertices[one.1 as usize].place = at as u32;
    }
}
