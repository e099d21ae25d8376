//! From the device to the host: a ring of buffers that the host can map.

use super::GpuError;
use super::device::Device;
use std::collections::VecDeque;

/// Batches under way at once: one is computed, one is copied, one is read.
const RING: usize = 3;

/// A batch under way.
struct Pending {
    buffer: usize,
    submission: wgpu::SubmissionIndex,
    /// First image of the batch and number of images.
    images: (usize, usize),
}

/// Staging buffers used in turn.
pub(super) struct Ring {
    buffers: Vec<wgpu::Buffer>,
    next: usize,
    pending: VecDeque<Pending>,
}

impl Ring {
    pub(super) fn new(device: &Device, bytes: u64) -> Self {
        let make = |_| {
            device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("staging"),
                size: bytes,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Self { buffers: (0..RING).map(make).collect(), next: 0, pending: VecDeque::new() }
    }

    /// Whether the oldest batch has to be taken before the next is put in.
    pub(super) fn is_full(&self) -> bool {
        self.pending.len() == RING
    }

    /// The buffer that the next batch is copied to.
    pub(super) fn buffer(&self) -> &wgpu::Buffer {
        &self.buffers[self.next]
    }

    /// A batch was submitted that ends in a copy to [`Ring::buffer`].
    pub(super) fn put(&mut self, submission: wgpu::SubmissionIndex, images: (usize, usize)) {
        // What becomes of the mapping shows when the range is asked for.
        self.buffers[self.next].map_async(wgpu::MapMode::Read, .., |_| {});
        self.pending.push_back(Pending { buffer: self.next, submission, images });
        self.next = (self.next + 1) % RING;
    }

    /// Waits for the oldest batch and hands out its bytes and images; returns whether there was one.
    pub(super) fn take(
        &mut self,
        device: &Device,
        mut read: impl FnMut(&[u8], (usize, usize)),
    ) -> Result<bool, GpuError> {
        let Some(batch) = self.pending.pop_front() else { return Ok(false) };
        device.wait(Some(batch.submission))?;
        let buffer = &self.buffers[batch.buffer];
        {
            let view = buffer.get_mapped_range(..).map_err(|e| GpuError::Device {
                adapter: device.adapter.to_string(),
                problem: format!("reading back: {e}"),
            })?;
            read(&view, batch.images);
        }
        buffer.unmap();
        Ok(true)
    }
}
