import torch

torch.set_num_threads(1)  # as in training; tests run beside each other
