#!/bin/bash
# A Monte Carlo run of host-sim as a Slurm array, a shard a task. Put in your scenario and plan, then
#
#     sbatch slurm.sh
#     host-sim merge /shared/joint/shard-*-of-16.parquet --out /shared/joint     # when all tasks are done
#
# A task that is put back into the queue, or submitted again (sbatch --array=3,7 slurm.sh), goes on where it was.
#SBATCH --job-name=monte-carlo
#SBATCH --array=1-16
#SBATCH --cpus-per-task=4
#SBATCH --time=01:00:00
#SBATCH --requeue

# Not SLURM_ARRAY_TASK_COUNT: an array of those that are missing has fewer.
SHARDS=16
exec host-sim monte-carlo joint.toml --uncertain 50 --trials 1000000 --threads "$SLURM_CPUS_PER_TASK" \
    --shard "$SLURM_ARRAY_TASK_ID/$SHARDS" --out /shared/joint --resume
