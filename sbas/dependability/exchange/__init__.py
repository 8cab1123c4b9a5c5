"""Fault trees and chains in the formats of other programs, with a report of what is lost."""
