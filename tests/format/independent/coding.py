"""The range coder, its models, and numbers made of bits (docs/format.md, "Coded payloads": "Bits")."""

from shell import require

_SHARES = [2**17 // (2 * seen + 3) for seen in range(255)]


class Models(dict):
    """The models of one kind of bit, by context. A model is [quick, steady, seen]."""

    def __missing__(self, context):
        model = self[context] = [1 << 15, 1 << 15, 0]
        return model


class Decoder:
    def __init__(self, data, place):
        self.data = data
        self.place = place
        self.range = 0xFFFFFFFF
        self.code = int.from_bytes(data[:4].ljust(4, b"\0"), "big")
        self.taken = 4
        require(self.code != 0xFFFFFFFF, place, "coded: starts with four bytes 0xFF")

    def bit(self, model):
        quick, steady, seen = model
        bound = (self.range >> 16) * ((quick + steady) >> 1)
        share = _SHARES[seen]
        if self.code < bound:
            bit = 1
            self.range = bound
            model[0] = quick + ((65536 - quick) >> 4)
            model[1] = steady + (((65536 - steady) * share) >> 16)
        else:
            bit = 0
            self.code -= bound
            self.range -= bound
            model[0] = quick - (quick >> 4)
            model[1] = steady - ((steady * share) >> 16)
        if seen < 254:
            model[2] = seen + 1
        while self.range < 1 << 24:
            self.range <<= 8
            byte = self.data[self.taken] if self.taken < len(self.data) else 0
            self.code = (self.code << 8) | byte
            self.taken += 1
        return bit

    def symbol(self, models, context, bits):
        before = 1
        for _ in range(bits):
            before = 2 * before + self.bit(models[context, before])
        return before - (1 << bits)

    def number(self, models, context, n):
        count = 0
        while count < n - 1 and self.bit(models[context, "count", count]):
            count += 1
        value = 1
        for place in range(count - 1, -1, -1):
            nth = count - 1 - place
            model = models[context, count, value] if nth < 2 else models[context, "place", place]
            value = 2 * value + self.bit(model)
        return value - 1

    def difference(self, models, context, n):
        if not self.bit(models[context, "differs"]):
            return 0
        negative = self.bit(models[context, "negative"])
        size = self.number(models, context, n) + 1
        return -size if negative else size

    def finish(self):
        fits = len(self.data) <= self.taken <= len(self.data) + 3
        require(fits, self.place, f"coded: takes {self.taken} bytes of {len(self.data)}")
