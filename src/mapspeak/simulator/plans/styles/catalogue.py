"""All styles by name."""

from collections.abc import Mapping
from types import MappingProxyType

from mapspeak.simulator.plans.styles.clinic import lay_out_clinic
from mapspeak.simulator.plans.styles.flat import lay_out_flat
from mapspeak.simulator.plans.styles.offices import lay_out_office, lay_out_ring_office
from mapspeak.simulator.plans.styles.school import lay_out_school
from mapspeak.simulator.plans.styles.style import Style
from mapspeak.simulator.plans.styles.workshop import lay_out_workshop

__all__ = ["STYLES"]

STYLES: Mapping[str, Style] = MappingProxyType(
    {
        style.name: style
        for style in (
            Style(name="clinic", title="A clinic", lay_out=lay_out_clinic),
            Style(name="flat", title="A flat", lay_out=lay_out_flat),
            Style(
                name="office", title="An office floor along one corridor", lay_out=lay_out_office
            ),
            Style(
                name="ring_office",
                title="An office floor around a ring of corridors",
                lay_out=lay_out_ring_office,
            ),
            Style(name="school", title="A school", lay_out=lay_out_school),
            Style(name="workshop", title="A workshop", lay_out=lay_out_workshop),
        )
    }
)
"""Every kind of building that can be drawn."""
