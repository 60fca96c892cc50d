"""Parts that formats of optical design programs share: tables by angles of incidence."""
