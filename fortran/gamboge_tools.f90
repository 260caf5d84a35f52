! L5, internal: text across the language border, what becomes of a status, and the shared context.
module gamboge_tools
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_null_char, &
      c_null_ptr, c_ptr, c_size_t
   use, intrinsic :: iso_fortran_env, only: error_unit, int32, int64
   use gamboge_c, only: gbg_context_destroy, gbg_e_space, gbg_message, gbg_ok
   implicit none
   private

   public :: c_text, f_text, buffer_text, report, settle, narrow, stop_copy
   public :: context_hold, context_release, context_handle

   abstract interface
      ! A log line. Give a module procedure: an internal one would need an executable stack.
      subroutine gbg_log_line(level, line)
         import :: c_int
         ! gbg_log_info or gbg_log_warning
         integer(c_int), intent(in) :: level
         ! without a line end
         character(*), intent(in) :: line
      end subroutine gbg_log_line
   end interface
   public :: gbg_log_line

   ! A C context and how many Fortran objects use it. The order in which a compiler finalises local
   ! variables is not fixed, so the C context goes with its last user, not with its first.
   type, public :: context_state
      type(c_ptr) :: handle = c_null_ptr
      integer :: users = 0
      procedure(gbg_log_line), pointer, nopass :: sink => null()
   end type context_state

   ! Bytes in the text buffers handed to C: longer than any path, name or plan line of the library.
   integer, parameter, public :: text_capacity = 4096

   interface
      integer(c_size_t) function strlen(text) bind(c)
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
      end function strlen
   end interface

contains

   ! Fortran text for C: without trailing blanks, with the final null.
   pure function c_text(text) result(copy)
      character(*), intent(in) :: text
      character(kind=c_char, len=len_trim(text) + 1) :: copy
      copy = trim(text)//c_null_char
   end function c_text

   ! Null-terminated C text; '' for NULL.
   function f_text(text) result(copy)
      type(c_ptr), intent(in) :: text
      character(:), allocatable :: copy
      character(kind=c_char), pointer :: letters(:)
      if (c_associated(text)) then
         call c_f_pointer(text, letters, [strlen(text)])
         copy = letters_text(letters)
      else
         copy = ''
      end if
   end function f_text

   ! The part of a buffer that comes before its null.
   pure function buffer_text(buffer) result(copy)
      character(kind=c_char), intent(in) :: buffer(:)
      character(:), allocatable :: copy
      integer :: length
      length = 0
      do while (length < size(buffer))
         if (buffer(length + 1) == c_null_char) exit
         length = length + 1
      end do
      copy = letters_text(buffer(:length))
   end function buffer_text

   pure function letters_text(letters) result(copy)
      character(kind=c_char), intent(in) :: letters(:)
      character(:), allocatable :: copy
      integer :: i
      allocate (character(len=size(letters)) :: copy)
      do i = 1, size(letters)
         copy(i:i) = letters(i)
      end do
   end function letters_text

   ! Ends every public call, like ALLOCATE: with stat the caller has control (and errmsg, which a
   ! successful call leaves alone); a failure without stat stops the program with the message.
   subroutine settle(status, message, stat, errmsg)
      integer(c_int), intent(in) :: status
      ! used only if status is a failure
      character(*), intent(in) :: message
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      if (present(stat)) stat = status
      if (status == gbg_ok) return
      if (present(errmsg)) errmsg = message
      if (present(stat)) return
      write (error_unit, '(a)') 'gamboge: '//message
      error stop 1
   end subroutine settle

   ! settle with the sentence that C stored, or with the problem that was seen before C was asked.
   subroutine report(context, status, stat, errmsg, problem)
      ! null: the object was never created
      type(context_state), pointer, intent(in) :: context
      integer(c_int), intent(in) :: status
      integer, intent(out), optional :: stat
      character(*), intent(inout), optional :: errmsg
      character(*), intent(in), optional :: problem
      if (status == gbg_ok) then
         call settle(status, '', stat, errmsg)
      else if (present(problem)) then
         call settle(status, problem, stat, errmsg)
      else
         call settle(status, f_text(gbg_message(context_handle(context))), stat, errmsg)
      end if
   end subroutine report

   ! Copies a count to a default integer, or turns status into a refusal when it does not fit.
   subroutine narrow(what, wide, value, status, problem)
      character(*), intent(in) :: what
      integer(int64), intent(in) :: wide
      integer(int32), intent(inout) :: value
      integer(c_int), intent(inout) :: status
      character(:), allocatable, intent(out) :: problem
      character(20) :: number
      if (status /= gbg_ok) return
      if (abs(wide) > huge(value)) then
         write (number, '(i0)') wide
         status = gbg_e_space
         problem = what//': the value '//trim(number)//' needs an integer(int64)'
      else
         value = int(wide, int32)
      end if
   end subroutine narrow

   ! A handle in two variables would be destroyed twice, so b = a is refused when it runs.
   subroutine stop_copy(type_name)
      character(*), intent(in) :: type_name
      write (error_unit, '(a)') 'gamboge: a '//type_name//' cannot be assigned: it is one '// &
         'object of the library, not a value'
      error stop 1
   end subroutine stop_copy

   function context_handle(context) result(handle)
      type(context_state), pointer, intent(in) :: context
      type(c_ptr) :: handle
      handle = c_null_ptr
      if (associated(context)) handle = context%handle
   end function context_handle

   ! One more object uses the context.
   subroutine context_hold(context, user)
      type(context_state), pointer, intent(in) :: context
      type(context_state), pointer, intent(out) :: user
      user => context
      user%users = user%users + 1
   end subroutine context_hold

   ! One object fewer; the last one takes the C context with it. Null: nothing to do.
   subroutine context_release(user)
      type(context_state), pointer, intent(inout) :: user
      integer(c_int) :: status
      if (.not. associated(user)) return
      user%users = user%users - 1
      if (user%users == 0) then
         status = gbg_context_destroy(user%handle)
         deallocate (user)
      end if
      user => null()
   end subroutine context_release
end module gamboge_tools
