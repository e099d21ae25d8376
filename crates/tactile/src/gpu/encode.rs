//! The passes of one batch, in order: as one command buffer, or each by itself with a clock.

use super::GpuError;
use super::batch::{GpuMesh, GpuSensor, TILE_BYTES};
use super::buffers::{Pass, bind_at, with_content};
use super::device::Device;
use super::layout::{Group, PressInput};
use super::pipelines::Stage;
use wgpu::BufferUsages;

/// Images that show the same mesh one after another: first image, images, mesh.
pub(super) type Run<'a> = (usize, usize, &'a GpuMesh);

/// A dispatch of a batch.
struct Draw<'a> {
    stage: &'a Stage,
    bound: wgpu::BindGroup,
    groups: [u32; 3],
}

impl<'a> Draw<'a> {
    fn of(pass: &'a Pass, groups: [u32; 3]) -> Self {
        Self { stage: &pass.stage, bound: pass.bound.clone(), groups }
    }

    fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_pipeline(&self.stage.pipeline);
        pass.set_bind_group(0, &self.bound, &[]);
        pass.dispatch_workgroups(self.groups[0], self.groups[1], self.groups[2]);
    }
}

impl GpuSensor {
    /// The commands of one batch.
    pub(super) fn encode(
        &self,
        device: &Device,
        presses: &[PressInput],
        runs: &[Run<'_>],
    ) -> wgpu::CommandEncoder {
        let images = presses.len() as u32;
        device.queue.write_buffer(&self.presses, 0, bytemuck::cast_slice(presses));
        let mut encoder = device.device.create_command_encoder(&Default::default());
        self.clear(&mut encoder, images);
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            self.draws(device, images, runs).iter().for_each(|draw| draw.dispatch(&mut pass));
        }
        encoder
    }

    /// Seconds that each stage takes of a batch, by its name and in order; each pass is repeated alone, so that what one leaves
    /// in caches for the next is not in it.
    pub(super) fn stage_seconds(
        &self,
        device: &Device,
        presses: &[PressInput],
        runs: &[Run<'_>],
        repeats: u32,
        clock_s: &dyn Fn() -> f64,
    ) -> Result<Vec<(&'static str, f64)>, GpuError> {
        let images = presses.len() as u32;
        device.queue.submit([self.encode(device, presses, runs).finish()]);
        let mut stages: Vec<(&'static str, f64)> = vec![];
        let mut measure = |name, fill: &mut dyn FnMut(&mut wgpu::CommandEncoder)| -> Result<(), GpuError> {
            let mut encoder = device.device.create_command_encoder(&Default::default());
            (0..repeats).for_each(|_| fill(&mut encoder));
            device.wait(None)?;
            let start_s = clock_s();
            device.queue.submit([encoder.finish()]);
            device.wait(None)?;
            let seconds = (clock_s() - start_s) / f64::from(repeats);
            match stages.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += seconds,
                None => stages.push((name, seconds)),
            }
            Ok(())
        };
        measure("clear", &mut |encoder| self.clear(encoder, images))?;
        // What the first passes add to is there already: they find it as it will be.
        for draw in self.draws(device, images, runs) {
            measure(draw.stage.name, &mut |encoder| {
                draw.dispatch(&mut encoder.begin_compute_pass(&Default::default()));
            })?;
        }
        Ok(stages)
    }

    fn clear(&self, encoder: &mut wgpu::CommandEncoder, images: u32) {
        encoder.clear_buffer(&self.tops, 0, Some(4 * u64::from(images)));
        encoder.clear_buffer(&self.stepped, 0, Some(TILE_BYTES * u64::from(images)));
        encoder.clear_buffer(&self.heights, 0, Some(4 * u64::from(images) * self.grid.len() as u64));
        if let Some(lowest) = &self.lowest {
            encoder.clear_buffer(lowest, 0, Some(12 * u64::from(images) * self.grid.len() as u64));
        }
    }

    /// All passes, in order.
    fn draws(&self, device: &Device, images: u32, runs: &[Run<'_>]) -> Vec<Draw<'_>> {
        let mut draws = vec![];
        let mut again = vec![];
        for (run, bound) in runs.iter().map(|run| (run, self.run_of(device, run))) {
            let (count, clusters) = (run.1 as u32, run.2.count);
            let [top, fill, points] = bound;
            let [of_top, of_fill, of_points] = &self.raster;
            draws.push(Draw { stage: of_top, bound: top, groups: [clusters.div_ceil(64), count, 1] });
            draws.push(Draw { stage: of_fill, bound: fill, groups: [clusters, count, 1] });
            again.push(Draw { stage: of_points, bound: points, groups: [clusters, count, 1] });
        }
        let [centres, find_steps, points] = &self.indent;
        draws.push(Draw::of(centres, [images, 1, 1]));
        draws.push(Draw::of(find_steps, [find_steps.groups[0], images, 1]));
        draws.extend(again);
        draws.push(Draw::of(points, [images, 1, 1]));
        draws.extend(self.between.iter().map(|p| Draw::of(p, [p.groups[0], p.groups[1], images])));
        draws.push(Draw::of(&self.image, [self.image.groups[0], images, 1]));
        draws
    }

    /// What the three draws of images that show the same mesh read and write: tops, centres, points.
    fn run_of(&self, device: &Device, &(first, _, mesh): &Run<'_>) -> [wgpu::BindGroup; 3] {
        let group = Group { first_image: first as u32, clusters: mesh.count };
        let group = with_content(device, "group", bytemuck::bytes_of(&group), BufferUsages::UNIFORM);
        let common = [&self.frame, &group, &mesh.clusters, &mesh.vertices];
        let common = common.into_iter().enumerate().map(|(i, buffer)| (i as u32, buffer));
        let all = common.chain([(5, &self.presses), (6, &self.tops)]);
        let drawn = |into| all.clone().chain([(4, &mesh.triangles), (7, into)]);
        let bound = |stage: usize, all: Vec<(u32, &wgpu::Buffer)>| {
            let all = all.into_iter().map(|(i, buffer)| (i, buffer.as_entire_binding()));
            bind_at(device, &self.raster[stage], all)
        };
        let points = drawn(&self.points).chain([(8, &self.steps), (9, &self.stepped)]);
        [
            bound(0, all.clone().collect()),
            bound(1, drawn(&self.heights).collect()),
            bound(2, points.collect()),
        ]
    }
}
