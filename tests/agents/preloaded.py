"""Imported once by the server that test sessions are forked from: all that takes time to load."""

import torch

import tests.agents.drift  # noqa: F401

torch.set_num_threads(1)
torch.optim.Adam([torch.nn.Parameter(torch.zeros(1))]).step()  # loads the compiler of torch
