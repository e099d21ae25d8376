//! Choosing an adapter and opening it.

use super::{AdapterChoice, GpuAdapter, GpuError};
use std::future::Future;
use std::pin::pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll, Waker};
use wgpu::{Backends, DeviceType};

/// Never GL: it is silently wrong for texture arrays of one layer (gfx-rs/wgpu#2161, #10015).
const BACKENDS: Backends = Backends::VULKAN.union(Backends::METAL).union(Backends::DX12);

/// An open adapter.
pub(super) struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) adapter: GpuAdapter,
    fault: Arc<Mutex<Option<String>>>,
}

impl Device {
    pub(super) fn open(choice: &AdapterChoice) -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = BACKENDS;
        let instance = wgpu::Instance::new(descriptor);
        let mut found: Vec<(wgpu::Adapter, wgpu::AdapterInfo)> = ready(instance.enumerate_adapters(BACKENDS))
            .into_iter()
            .map(|adapter| {
                let info = adapter.get_info();
                (adapter, info)
            })
            .collect();
        let Some(chosen) = choose(choice, found.iter().map(|(_, info)| info)) else {
            let found = found.iter().map(|(_, info)| describe(info).to_string()).collect();
            return Err(GpuError::NoAdapter { wanted: choice.clone(), found });
        };
        let (adapter, info) = found.swap_remove(chosen);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("gripgen"),
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let adapter_name = describe(&info);
        let (device, queue) = ready(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::Device { adapter: adapter_name.to_string(), problem: one_line(&e) })?;
        let fault = Arc::new(Mutex::new(None));
        let keep = |fault: &Arc<Mutex<Option<String>>>, problem: String| {
            fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(problem);
        };
        let slot = fault.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep(&slot, one_line(&e))));
        let slot = fault.clone();
        device.set_device_lost_callback(move |reason, message| {
            // Dropping it is no fault.
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep(&slot, format!("the device was lost: {message}"));
            }
        });
        Ok(Self { device, queue, adapter: adapter_name, fault })
    }

    /// Fails if the device reported a fault.
    pub(super) fn check(&self) -> Result<(), GpuError> {
        match &*self.fault.lock().unwrap_or_else(PoisonError::into_inner) {
            None => Ok(()),
            Some(problem) => {
                Err(GpuError::Device { adapter: self.adapter.to_string(), problem: problem.clone() })
            }
        }
    }

    /// Waits for a submission, or for all.
    pub(super) fn wait(&self, submission: Option<wgpu::SubmissionIndex>) -> Result<(), GpuError> {
        let wait = wgpu::PollType::Wait { submission_index: submission, timeout: None };
        self.device
            .poll(wait)
            .map_err(|e| GpuError::Device { adapter: self.adapter.to_string(), problem: one_line(&e) })?;
        self.check()
    }
}

/// Place of the adapter to take.
fn choose<'a>(
    choice: &AdapterChoice,
    mut found: impl Iterator<Item = &'a wgpu::AdapterInfo> + Clone,
) -> Option<usize> {
    match choice {
        AdapterChoice::Hardware => {
            [DeviceType::DiscreteGpu, DeviceType::IntegratedGpu, DeviceType::VirtualGpu]
                .into_iter()
                .find_map(|kind| found.clone().position(|info| info.device_type == kind))
        }
        AdapterChoice::Named(name) => {
            let name = name.to_lowercase();
            found.position(|info| info.name.to_lowercase().contains(&name))
        }
    }
}

fn describe(info: &wgpu::AdapterInfo) -> GpuAdapter {
    GpuAdapter {
        name: info.name.clone(),
        api: format!("{:?}", info.backend).to_lowercase(),
        driver: [info.driver.as_str(), info.driver_info.as_str()].join(" ").trim().into(),
        software: info.device_type == DeviceType::Cpu,
    }
}

fn one_line(e: &dyn std::fmt::Display) -> String {
    e.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The value of a future of wgpu, which are done when they are made on these platforms.
fn ready<F: Future>(future: F) -> F::Output {
    let mut future = pin!(future);
    loop {
        match future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(value) => return value,
            Poll::Pending => std::hint::spin_loop(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(name: &str, device_type: DeviceType) -> wgpu::AdapterInfo {
        let mut info = wgpu::AdapterInfo::new(device_type, wgpu::Backend::Vulkan);
        info.name = name.into();
        info
    }

    #[test]
    fn a_software_adapter_is_taken_by_name_only() {
        let software = [info("llvmpipe (LLVM 15.0.6, 256 bits)", DeviceType::Cpu)];
        assert_eq!(choose(&AdapterChoice::Hardware, software.iter()), None);
        assert_eq!(choose(&AdapterChoice::Named("LLVMpipe".into()), software.iter()), Some(0));
        assert_eq!(choose(&AdapterChoice::Named("H200".into()), software.iter()), None);
        let all = [
            info("llvmpipe", DeviceType::Cpu),
            info("built in", DeviceType::IntegratedGpu),
            info("card", DeviceType::DiscreteGpu),
            info("?", DeviceType::Other),
        ];
        assert_eq!(choose(&AdapterChoice::Hardware, all.iter()), Some(2));
        assert_eq!(choose(&AdapterChoice::Hardware, all[..2].iter()), Some(1));
        assert_eq!(choose(&AdapterChoice::Hardware, all[3..].iter()), None);
    }
}
