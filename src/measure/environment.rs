//! The machine a figure was taken on.

use serde::Serialize;

/// What a reader needs to compare figures.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Environment {
    /// Version of this program.
    pub version: String,
    /// Commit it was built from, when git could tell.
    pub commit: Option<String>,
    /// Operating system.
    pub os: String,
    /// Processor.
    pub cpu: Option<String>,
    /// Logical cores.
    pub cores: usize,
    /// Graphics adapter.
    pub adapter: String,
    /// Graphics interface.
    pub backend: String,
    /// Driver and its version.
    pub driver: String,
    /// Version of wgpu.
    pub wgpu: String,
}

#[cfg(feature = "cli")]
impl Environment {
    /// Asks the system and the adapter.
    #[must_use]
    pub fn gather(info: &wgpu::AdapterInfo) -> Self {
        let cpu = sysinfo::System::new().ok().and_then(|mut system| {
            system.refresh_cpu_list(sysinfo::CpuRefreshKind::nothing());
            system.cpus().first().map(|c| c.brand().trim().to_string())
        });
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("TESSCLIP_COMMIT").map(Into::into),
            os: sysinfo::System::long_os_version().unwrap_or_else(|_| std::env::consts::OS.into()),
            cpu,
            cores: std::thread::available_parallelism().map_or(1, Into::into),
            adapter: info.name.clone(),
            backend: format!("{:?}", info.backend),
            driver: format!("{} {}", info.driver, info.driver_info),
            wgpu: "30".into(),
        }
    }
}
