//! A block of source text: its place in the answer, its nesting, its syntax tree.
//!
//! Text and the line it starts on come in; a parsed module, or a syntax fault with line and column, goes
//! out. Imports the parser and the limits.

use ruff_python_ast::token::TokenKind;
use ruff_python_ast::{ModModule, Suite};
use ruff_python_parser::{Mode, Parsed, lexer, parse_module};
use ruff_text_size::TextSize;

use super::error::{CodeError, Fault};
use super::limits::Limits;

/// A block of code and where it stands in the text around it.
#[derive(Clone, Debug)]
pub struct Source {
    text: String,
    first_line: usize,
    indent: usize,
}

/// Brackets, blocks and operators that may be nested in each other: bounds the depth of the syntax tree.
const MAX_NESTING: usize = 200;

impl Source {
    /// `text` starts on line `first_line` of its file, with `indent` characters taken off every line.
    pub fn new(text: &str, first_line: usize, indent: usize) -> Self {
        Self { text: text.to_owned(), first_line, indent }
    }

    /// Line and column of an offset; what is missing at the end is missed at the last word.
    pub fn place(&self, offset: TextSize) -> (usize, usize) {
        let end = self.text.floor_char_boundary(offset.to_usize().min(self.text.trim_end().len()));
        let before = &self.text[..end];
        let line = before.matches('\n').count();
        let column = before.rsplit('\n').next().map_or(0, |last| last.chars().count());
        (self.first_line + line, self.indent + column + 1)
    }

    /// The error for a fault at an offset.
    pub fn error(&self, fault: Fault, offset: TextSize) -> CodeError {
        let (line, column) = self.place(offset);
        CodeError { line, column, fault }
    }

    /// The statements, if the text is Python that is not nested beyond reason.
    pub fn parse(&self, limits: &Limits) -> Result<Suite, CodeError> {
        if self.text.len() > limits.source_bytes {
            let fault = Fault::limit("bytes of source code", limits.source_bytes as u64);
            return Err(self.error(fault, TextSize::new(0)));
        }
        self.check_nesting()?;
        parse_module(&self.text)
            .map(Parsed::<ModModule>::into_suite)
            .map_err(|error| self.error(Fault::Syntax(error.error.to_string()), error.location.start()))
    }

    /// Refuses text whose tree would be deep enough to exhaust the stack of a recursive walk. The depth of
    /// an expression is at most the brackets open around it plus the operators since the last comma at
    /// each of those levels; lambdas have commas of their own and are counted to the end of the line.
    fn check_nesting(&self) -> Result<(), CodeError> {
        let mut lexer = lexer::lex(&self.text, Mode::Module);
        let mut levels = vec![0usize];
        let (mut blocks, mut lambdas, mut lines) = (0usize, 0usize, 0usize);
        loop {
            let kind = lexer.next_token();
            match kind {
                TokenKind::EndOfFile => return Ok(()),
                TokenKind::Indent => blocks += 1,
                TokenKind::Dedent => blocks = blocks.saturating_sub(1),
                TokenKind::Newline => (levels, lambdas, lines) = (vec![0], 0, lines + 1),
                TokenKind::NonLogicalNewline => lines += 1,
                TokenKind::Lpar | TokenKind::Lsqb | TokenKind::Lbrace => levels.push(1),
                TokenKind::FStringStart | TokenKind::TStringStart => levels.push(1),
                TokenKind::Rpar | TokenKind::Rsqb | TokenKind::Rbrace if levels.len() > 1 => {
                    levels.pop();
                    bump(&mut levels);
                }
                TokenKind::FStringEnd | TokenKind::TStringEnd if levels.len() > 1 => {
                    levels.pop();
                }
                TokenKind::Comma | TokenKind::Semi => reset(&mut levels),
                TokenKind::Lambda => lambdas += 1,
                kind if kind.is_operator() || kind.is_keyword() => bump(&mut levels),
                _ => {}
            }
            if levels.iter().sum::<usize>() + blocks + lambdas > MAX_NESTING {
                let fault = Fault::limit("brackets and operators nested in each other", MAX_NESTING as u64);
                return Err(CodeError { line: self.first_line + lines, column: self.indent + 1, fault });
            }
        }
    }
}

/// Whether a text is Python that is not nested beyond reason.
pub fn is_python(text: &str) -> bool {
    Source::new(text, 1, 0).parse(&Limits::default()).is_ok()
}

/// One more operator at the innermost level.
fn bump(levels: &mut [usize]) {
    if let Some(top) = levels.last_mut() {
        *top += 1;
    }
}

/// A comma: the next item starts from the depth of its bracket.
fn reset(levels: &mut [usize]) {
    let base = usize::from(levels.len() > 1);
    if let Some(top) = levels.last_mut() {
        *top = base;
    }
}
