"""Quaymark: shore-camera photographs and AIS messages, fused into reviewed 6D vessel poses."""

__version__ = "0.1.0"
