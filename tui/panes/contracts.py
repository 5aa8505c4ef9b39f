"""The Contracts tab: what must hold of the table, as sentences, proved as one types.

Enter takes the counterexample of a contract to the test row. Contracts are edits like others: undone, and saved with the table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.content import Content
from textual.message import Message
from textual.widgets import Input, Static
from textual.worker import get_current_worker

from contextdb.covering import Cancelled
from contextdb.covering.contracts import Proof, prove
from contextdb.errors import ContextDBError, plural
from contextdb.schema.contracts import Contract
from contextdb.schema.sections import contract_to_dict
from contextdb.tables.changes import Edit, Sections
from contextdb.tables.table import Table

from ..messages import Edited, Notice, SetContext
from ..model.contract_sentences import EXAMPLE, facts_of, name_for, read_sentence, sentence_of
from ..model.sheet import Sheet
from ..widgets.line_list import LineList, ListCell, ListColumn
from .pane import Pane

REST_S = 0.15
"""So long after a key the sentence is proved."""
WORDS = {True: ("holds", "info"), False: ("broken", "error"), None: ("open", "warning")}
BEGUN = "Whenever "
"""What a new contract begins with."""
NEW = ""
NONE = "A contract says in a sentence which rows can play, and is proved for every context."
"""The name of a contract that is being written."""


class ContractList(LineList):
    """The contracts."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "choose", "To the test row")]


class ContractsPane(Pane):
    """What must hold of the table."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("n", "new", "New"),
        Binding("e", "edit", "Edit"),
        Binding("delete", "delete", "Delete"),
        Binding("escape", "leave", "Back", show=False),
    ]
    DEFAULT_CSS = """
    ContractsPane {
        layout: vertical; height: 1fr; background: $surface;
        & > #contracts-summary { height: auto; max-height: 3; padding: 0 2; text-style: bold; }
        & > LineList { height: 1fr; }
        & > #contracts-says { height: auto; min-height: 2; max-height: 40%; padding: 0 2; border-top: solid $panel; }
        & > Input { height: 1; border: none; padding: 0 2; background: $panel; }
        & > Input:focus { border: none; background: $primary 30%; }
    }
    """

    @dataclass
    class Proved(Message):
        """What came out for a contract of a table; sent from another thread."""

        table: Table
        proof: Proof

    def __init__(self, sheet: Sheet, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self.sheet = sheet
        self.proofs: dict[str, Proof] = {}
        """What is known of the contracts of the table, by name."""
        self.typed: Proof | None = None
        """What is known of the sentence that is being typed."""
        self._of: Table | None = None
        self._edited: str | None = None
        """The contract that is being edited."""

    def compose(self) -> ComposeResult:
        yield Static(id="contracts-summary", markup=False)
        columns = [ListColumn("", 8), ListColumn("Contract", 30, 1)]
        yield ContractList(columns, empty="No contract. N writes one.", id="contract-list")
        yield Static(id="contracts-says", markup=False)
        yield Input(placeholder="N writes a contract", id="contract-sentence", select_on_focus=False)

    def on_mount(self) -> None:
        self.show()

    def show(self) -> None:
        """Prove the contracts of a table that changed; what is typed is proved again too."""
        if self._of is self.sheet.table:
            return
        self._of = self.sheet.table
        self.proofs = {}
        self._fill()
        self._prove([*self.contracts], "list")
        if self._edited is not None:
            self._prove_typed()

    @property
    def contracts(self) -> list[Contract]:
        table = self.sheet.table
        return [contract for contract in table.schema.contracts.values() if contract.table == table.name]

    def take_focus(self) -> None:
        self.query_one(LineList).focus()

    # ---- proofs

    def _prove(self, contracts: Sequence[Contract], group: str) -> None:
        table = self.sheet.table
        self.run_worker(lambda: self._proved_in_turn(table, contracts), thread=True, exclusive=True, group=group)

    def _proved_in_turn(self, table: Table, contracts: Sequence[Contract]) -> None:
        worker = get_current_worker()
        for contract in contracts:
            try:
                proof = prove(contract, table, should_stop=lambda: worker.is_cancelled)
            except Cancelled:
                return
            if not worker.is_cancelled:
                self.post_message(self.Proved(table, proof))

    @on(Proved)
    def _proved(self, event: Proved) -> None:
        event.stop()
        if event.table is not self.sheet.table:
            return
        if event.proof.contract.name == NEW:
            self.typed = event.proof
            self._say(event.proof)
        else:
            self.proofs[event.proof.contract.name] = event.proof
            self._fill()

    # ---- display

    def _fill(self, chosen: str = "") -> None:
        """Show the contracts, with the line of one of them chosen."""
        contracts, proofs = self.contracts, self.proofs
        n_held = sum(proof.holds is True for proof in proofs.values())
        rest = "" if len(proofs) == len(contracts) else " Proving …"
        proved = f"{n_held} of {plural(len(contracts), 'contract')} proved.{rest}" if contracts else NONE
        self.query_one("#contracts-summary", Static).update(proved)
        lines = self.query_one(LineList)
        at = next((at for at, contract in enumerate(contracts) if contract.name == chosen), max(lines.index, 0))
        lines.show(len(contracts), lambda at: _line(contracts[at], proofs.get(contracts[at].name)), at)
        self._say_of_line()

    def _say_of_line(self) -> None:
        if self._edited is None:
            contract = self._chosen
            proof = self.proofs.get(contract.name) if contract is not None else None
            self._say(proof, "" if self.contracts else f"Such as: {EXAMPLE}.")

    def _say(self, proof: Proof | None, problem: str = "") -> None:
        words = problem or ("" if proof is None else _verdict(proof))
        self.query_one("#contracts-says", Static).update(Content(words))

    @property
    def _chosen(self) -> Contract | None:
        contracts, at = self.contracts, self.query_one(LineList).index
        return contracts[at] if 0 <= at < len(contracts) else None

    @on(LineList.Moved)
    def _moved(self, event: LineList.Moved) -> None:
        event.stop()
        self._say_of_line()

    # ---- what can be done

    @on(LineList.Chosen)
    def _taken(self, event: LineList.Chosen) -> None:
        event.stop()
        contract = self._chosen
        if contract is not None:
            self._take(self.proofs.get(contract.name), sentence_of(contract))

    def _take(self, proof: Proof | None, name: str) -> None:
        """Take a counterexample to the test row."""
        if proof is None or proof.witness is None:
            self.post_message(Notice("There is no counterexample to take to the test row."))
        else:
            self.post_message(SetContext(facts_of(proof.witness.context), f"breaks: {name}"))

    def action_new(self) -> None:
        self._edit(NEW, BEGUN)

    def action_edit(self) -> None:
        if (contract := self._chosen) is not None:
            self._edit(contract.name, sentence_of(contract))

    def _edit(self, name: str, text: str) -> None:
        self._edited, self.typed = name, None
        line = self.query_one(Input)
        line.value = text
        line.cursor_position = len(text)
        line.focus()

    def action_delete(self) -> None:
        if (contract := self._chosen) is not None:
            self._change({contract.name: None}, f"Delete the contract {contract.name}")

    def action_leave(self) -> None:
        """Leave the sentence as it was."""
        self._edited, self.typed = None, None
        self.query_one(Input).value = ""
        self.take_focus()
        self._say_of_line()

    @on(Input.Changed)
    def _typed(self, event: Input.Changed) -> None:
        event.stop()
        if self._edited is None and event.value:
            self._edited = NEW
        if self._edited is not None:
            self.set_timer(REST_S, lambda: self._prove_typed() if self.query_one(Input).value == event.value else None)

    def _prove_typed(self) -> None:
        contract, problem = self._of_text()
        self.typed = None
        if self.query_one(Input).value.strip() in ("", BEGUN.strip()):
            self._say(None, f"A sentence, such as: {EXAMPLE}")
        elif contract is None:
            self._say(None, problem)
        else:
            self._say(None, "Proving …")
            self._prove([contract], "typed")

    def _of_text(self) -> tuple[Contract | None, str]:
        """The contract that is typed, without a name, or what is wrong with it."""
        sentence = read_sentence(self.query_one(Input).value, self.sheet.table.name)
        if sentence.fault is not None:
            return None, sentence.fault.message
        try:
            return Contract(NEW, **dict(sentence.part)), ""  # type: ignore[arg-type]
        except ContextDBError as error:
            return None, error.faults[0].message

    @on(Input.Submitted)
    def _submitted(self, event: Input.Submitted) -> None:
        """Keep the contract that is typed, whether it holds or not."""
        event.stop()
        contract, problem = self._of_text()
        if contract is None or (self.typed is not None and self.typed.problem):
            self._say(self.typed, problem)
            return
        part = contract_to_dict(contract)
        name = self._edited or name_for(part, self.sheet.table.schema.contracts)
        self._edited = None
        self.query_one(Input).value = ""
        self._change({name: part}, f"Contract {name}")
        self._fill(name)
        self.take_focus()

    def _change(self, parts: Mapping[str, Mapping[str, object] | None], name: str) -> None:
        try:
            done = self.sheet.apply(Edit(name, (Sections(parts={"contracts": parts}),)))
        except ContextDBError as error:
            self.post_message(Notice(str(error), "error"))
            return
        self.screen.post_message(Edited(done))


def _line(contract: Contract, proof: Proof | None) -> Sequence[ListCell]:
    word, tone = ("…", "muted") if proof is None else ("unread", "error") if proof.problem else WORDS[proof.holds]
    return [(word, tone), sentence_of(contract)]


def _verdict(proof: Proof) -> str:
    if proof.problem:
        return f"✗ {proof.problem}"
    if proof.witness is None:
        return f"{'✓ ' if proof.holds else ''}{proof.sentence}"
    facts = ", ".join(f"{name}: {fact}" for name, fact in facts_of(proof.witness.context).items())
    valid = ", ".join(proof.witness.assets[:3]) or "no row"
    return f"✗ {proof.sentence}\nFor example {facts}: {valid}. Enter takes it to the test row."
