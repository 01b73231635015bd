//! A heap of vertices by distance in which a vertex is once (binary heap: Williams, "Heapsort", Commun. ACM 7 (1964) 347-348).

/// Not in the heap.
const OUT: u32 = u32::MAX;

#[derive(Clone, Debug)]
pub(super) struct VertexHeap {
    /// Filled up to `count`; as long as there are vertices, so that it never grows.
    heap: Box<[u32]>,
    place: Box<[u32]>,
    count: usize,
}

impl VertexHeap {
    pub(super) fn new(vertices: usize) -> Self {
        Self { heap: vec![0; vertices].into(), place: vec![OUT; vertices].into(), count: 0 }
    }

    pub(super) fn clear(&mut self) {
        for &vertex in &self.heap[..self.count] {
            self.place[vertex as usize] = OUT;
        }
        self.count = 0;
    }

    /// Puts a vertex in or moves it up, after its distance fell.
    pub(super) fn raise(&mut self, vertex: u32, distances: &[f64]) {
        let mut at = self.place[vertex as usize] as usize;
        if self.place[vertex as usize] == OUT {
            at = self.count;
            self.count += 1;
            self.set(at, vertex);
        }
        while at > 0 {
            let parent = (at - 1) / 2;
            let other = self.heap[parent];
            if distances[other as usize] <= distances[vertex as usize] {
                break;
            }
            self.set(at, other);
            at = parent;
        }
        self.set(at, vertex);
    }

    /// Takes the nearest out.
    pub(super) fn pop(&mut self, distances: &[f64]) -> Option<u32> {
        if self.count == 0 {
            return None;
        }
        let nearest = self.heap[0];
        self.place[nearest as usize] = OUT;
        self.count -= 1;
        if self.count > 0 {
            self.sink(self.heap[self.count], distances);
        }
        Some(nearest)
    }

    /// Puts a vertex at the top and lets it down.
    fn sink(&mut self, vertex: u32, distances: &[f64]) {
        let mut at = 0;
        loop {
            let mut child = 2 * at + 1;
            if child >= self.count {
                break;
            }
            let of = |index: usize| distances[self.heap[index] as usize];
            if child + 1 < self.count && of(child + 1) < of(child) {
                child += 1;
            }
            if distances[vertex as usize] <= of(child) {
                break;
            }
            self.set(at, self.heap[child]);
            at = child;
        }
        self.set(at, vertex);
    }

    fn set(&mut self, at: usize, vertex: u32) {
        self.heap[at] = vertex;
        self.place[vertex as usize] = at as u32;
    }
}
