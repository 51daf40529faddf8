"""Quaymark: shore-camera photographs and AIS messages, fused into reviewed 6D vessel poses."""
