"""Fit the network to rendered scenes, from random weights or on from an earlier run.

Two processes with one thread each take half of every batch and average their gradients: on a
machine shared with others that is many times faster than one process with two threads, which
would wait for one another in every layer. The weights that are kept are a moving average (EMA).
The same seed, scenes, steps and number of processes give the same network.
"""

import argparse
import copy
import os
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import cos, pi
from pathlib import Path

import cv2
import numpy as np
import torch
from torch import distributed, multiprocessing, nn

from tools.train_harbour_detector import dataset
from tools.train_harbour_detector.loss import loss_of
from tools.train_harbour_detector.model import YoloxNano, grid

_WARM_UP, _LOWEST = 100, 0.02  # steps; share of the highest learning rate
_EMA_MEMORY = 200  # steps
_LARGEST_GRADIENT = 10.0


@dataclass(frozen=True, slots=True)
class Plan:
    """What a training run depends on."""

    data: Path
    out: Path
    harbours: int
    steps: int
    batch: int  # of each process
    rate: float
    seed: int
    processes: int
    port: int
    start: Path | None
    until: int | None


def train(rank: int, plan: Plan) -> None:
    """Run one of the processes to the end; the first one logs and writes checkpoints."""
    os.environ.update(MASTER_ADDR="127.0.0.1", MASTER_PORT=str(plan.port))
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    distributed.init_process_group("gloo", rank=rank, world_size=plan.processes)
    torch.manual_seed(plan.seed)  # the same first weights everywhere
    network = YoloxNano().to(memory_format=torch.channels_last).train()
    if plan.start:
        network.load_state_dict(torch.load(plan.start, weights_only=True))
    average = copy.deepcopy(network).eval()
    optimiser = _optimiser(network, plan.rate)
    scenes = dataset.load_scenes(plan.data, plan.harbours)
    cells = grid(dataset.WIDTH_PX, dataset.HEIGHT_PX)

    def batch(step: int) -> tuple[np.ndarray, list[dataset.Scene]]:
        rng = np.random.default_rng([plan.seed, rank, step])
        return dataset.draw_batch(scenes, rng, plan.batch)

    began, heard = time.monotonic(), []
    with ThreadPoolExecutor(1) as ahead:
        coming = ahead.submit(batch, 0)
        last = min(plan.until or plan.steps, plan.steps)
        for step in range(last):
            images, samples = coming.result()
            coming = ahead.submit(batch, step + 1)
            for group in optimiser.param_groups:
                group["lr"] = plan.rate * _share(step, plan.steps)
            x = torch.from_numpy(images).float().to(memory_format=torch.channels_last)
            loss, parts = loss_of(
                network(x), [torch.from_numpy(sample.boxes) for sample in samples], cells
            )
            optimiser.zero_grad()
            loss.backward()
            _average_gradients(network, plan.processes)
            nn.utils.clip_grad_norm_(network.parameters(), _LARGEST_GRADIENT)
            optimiser.step()
            _follow(average, network, step)
            heard.append(parts)
            if rank == 0 and (step + 1) % 50 == 0:
                _log(step + 1, time.monotonic() - began, heard)
                heard.clear()
            if rank == 0 and ((step + 1) % 100 == 0 or step + 1 == last):
                torch.save(average.state_dict(), plan.out)
    distributed.destroy_process_group()


def _optimiser(network: nn.Module, rate: float) -> torch.optim.Optimizer:
    """AdamW; weights decay, biases and normalisations do not."""
    kernels = [p for p in network.parameters() if p.ndim > 1]
    others = [p for p in network.parameters() if p.ndim <= 1]
    groups = [{"params": kernels, "weight_decay": 0.02}, {"params": others, "weight_decay": 0.0}]
    return torch.optim.AdamW(groups, lr=rate)


def _share(step: int, steps: int) -> float:
    """Learning rate as a share of the highest: up in a line, down along a cosine."""
    if step < _WARM_UP:
        return (step + 1) / _WARM_UP
    done = (step - _WARM_UP) / max(1, steps - _WARM_UP)
    return _LOWEST + (1 - _LOWEST) * (1 + cos(pi * done)) / 2


def _average_gradients(network: nn.Module, processes: int) -> None:
    gradients = [p.grad for p in network.parameters() if p.grad is not None]
    flat = torch.cat([gradient.flatten() for gradient in gradients])
    distributed.all_reduce(flat)
    at = 0
    for gradient in gradients:
        gradient.copy_(flat[at : at + gradient.numel()].view_as(gradient) / processes)
        at += gradient.numel()


@torch.no_grad()
def _follow(average: nn.Module, network: nn.Module, step: int) -> None:
    """Move the average a little towards the network; much at first."""
    share = 1 / min(_EMA_MEMORY, step / 5 + 1)
    for kept, new in zip(average.state_dict().values(), network.state_dict().values(), strict=True):
        if kept.is_floating_point():
            kept.lerp_(new, share)


def _log(step: int, seconds: float, heard: list[dict[str, float]]) -> None:
    names = ("objectness", "box", "class", "distance")
    means = {n: float(np.nanmean([parts.get(n, np.nan) for parts in heard])) for n in names}
    print(step, f"{seconds:.0f} s", {n: round(v, 3) for n, v in means.items()}, flush=True)


def _main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--data", type=Path, required=True, help="folder of rendered harbours")
    parser.add_argument("--harbours", type=int, required=True, help="how many of them to use")
    parser.add_argument("--out", type=Path, required=True, help="file of the trained weights (.pt)")
    parser.add_argument("--steps", type=int, default=1400)
    parser.add_argument("--batch", type=int, default=3, help="images of each process and step")
    parser.add_argument("--rate", type=float, default=2e-3, help="highest learning rate")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--port", type=int, default=29517, help="where the processes meet")
    parser.add_argument("--start", type=Path, help="go on from weights an earlier run has written")
    parser.add_argument("--until", type=int, help="end here, before the schedule is through")
    plan = Plan(**vars(parser.parse_args()))
    multiprocessing.spawn(train, args=(plan,), nprocs=plan.processes)


if __name__ == "__main__":
    _main()
