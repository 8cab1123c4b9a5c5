"""NMEA 0183: sentences of any talker, and the proprietary PASHR,POS and PUBX,00."""
