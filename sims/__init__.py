"""Simulators: pure, batched systems that host named physical effects, and tasks on them."""

from sims.registration import register

register()
