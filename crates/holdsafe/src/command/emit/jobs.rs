//! The files of each engine, which start the two scripts of `emit`.

use std::path::Path;

use runner::failure::Failure;
use runner::{out, quoted};

use super::script;

/// An engine of jobs.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(super) enum Engine {
    /// GNU make, on this machine.
    Make,
    /// Slurm: an array, and a job after it.
    Slurm,
    /// HyperQueue, on its own workers or on those that Slurm or PBS gives it.
    Hyperqueue,
}

/// Everything that the files are written from.
pub(super) struct Jobs {
    pub(super) partitions: u64,
    /// Cores of a partition.
    pub(super) cores: u16,
    /// The folder, absolute.
    pub(super) dir: String,
    /// The file that putting together ends with.
    pub(super) result: &'static str,
}

impl Jobs {
    /// Writes the engine's own file, and says how to start it.
    pub(super) fn write(&self, dir: &Path, engine: Engine) -> Result<String, Failure> {
        let folder = quoted(&self.dir);
        match engine {
            Engine::Make => {
                out::write_text(dir, "Makefile", &self.makefile())?;
                Ok(format!("make -C {folder} -j {}", parallel::cores()))
            }
            Engine::Slurm => {
                out::write_text(dir, "part.sbatch", &self.array())?;
                out::write_text(dir, "merge.sbatch", &self.dependencies())?;
                script(dir, "submit", &self.submit())?;
                Ok(format!("{folder}/submit"))
            }
            Engine::Hyperqueue => {
                out::write_text(dir, "job.toml", &self.tasks()?)?;
                Ok(format!("hq job submit-file {folder}/job.toml"))
            }
        }
    }

    fn makefile(&self) -> String {
        let Jobs { partitions: n, result, .. } = self;
        format!(
            "parts := $(shell seq 1 {n})\n# In the target of a rule this sign would make it an assignment.\neq := =\n\n\
             result/{result}: $(parts:%=parts/partition$(eq)%/done)\n\t./merge\n\n\
             parts/partition$(eq)%/done:\n\t./part $*\n\ttouch $@\n"
        )
    }

    fn array(&self) -> String {
        let Jobs { partitions, cores, dir, .. } = self;
        format!(
            "#!/bin/sh\n#SBATCH --job-name=holdsafe\n#SBATCH --array=1-{partitions}\n#SBATCH --cpus-per-task={cores}\n\
             #SBATCH --requeue\n#SBATCH --output=/dev/null\n\
             exec {part} \"$SLURM_ARRAY_TASK_ID\" >{dir}/part-\"$SLURM_ARRAY_TASK_ID\".log 2>&1\n",
            part = quoted(&format!("{dir}/part")),
            dir = quoted(dir),
        )
    }

    fn dependencies(&self) -> String {
        let dir = quoted(&self.dir);
        format!(
            "#!/bin/sh\n#SBATCH --job-name=holdsafe-merge\n#SBATCH --output=/dev/null\n\
             exec {dir}/merge >{dir}/merge.log 2>&1\n"
        )
    }

    fn submit(&self) -> String {
        let dir = quoted(&self.dir);
        format!(
            "#!/bin/sh\n# Submits the array, and the merging for when all of it has succeeded.\n\
             parts=$(sbatch --parsable {dir}/part.sbatch) || exit\n\
             exec sbatch --dependency=afterok:\"$parts\" {dir}/merge.sbatch\n"
        )
    }

    /// HyperQueue's job definition file.
    fn tasks(&self) -> Result<String, Failure> {
        let text = |value: String| toml::Value::String(value);
        let table = |entries: Vec<(&str, toml::Value)>| {
            toml::Value::Table(entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect())
        };
        let output = |name: String| text(format!("{}/{name}.log", self.dir));
        let cores = table(vec![("resources", table(vec![("cpus", i64::from(self.cores).into())]))]);
        let one = |i: u64| {
            let command = vec![text(format!("{}/part", self.dir)), text(i.to_string())];
            let logged = output(format!("part-{i}"));
            table(vec![
                ("id", (i as i64).into()),
                ("command", command.into()),
                ("stdout", logged.clone()),
                ("stderr", logged),
                ("request", vec![cores.clone()].into()),
            ])
        };
        let all: Vec<toml::Value> = (1..=self.partitions).map(|i| (i as i64).into()).collect();
        let merge = table(vec![
            ("id", 0.into()),
            ("command", vec![text(format!("{}/merge", self.dir))].into()),
            ("stdout", output("merge".to_owned())),
            ("stderr", output("merge".to_owned())),
            ("deps", all.into()),
        ]);
        let tasks: Vec<toml::Value> = (1..=self.partitions).map(one).chain([merge]).collect();
        let job = table(vec![("name", text("holdsafe".to_owned())), ("task", tasks.into())]);
        toml::to_string(&job).map_err(Failure::internal)
    }
}
