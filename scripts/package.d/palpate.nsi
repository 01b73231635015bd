; The Windows installer: for the user who runs it, without administrator rights. /S installs silently, /D=FOLDER chooses.
; makensis -DVERSION=... -DPROGRAM=FOLDER -DICON=FILE -DOUT=FILE palpate.nsi
; Of 64 bits, as the program.
Target amd64-unicode
SetCompressor /SOLID lzma
SetDateSave off
Name "palpate"
OutFile "${OUT}"
Icon "${ICON}"
UninstallIcon "${ICON}"
RequestExecutionLevel user
InstallDir "$LOCALAPPDATA\Programs\palpate"
InstallDirRegKey HKCU "Software\palpate" "Folder"
Page directory
Page instfiles
UninstPage uninstConfirm
UninstPage instfiles

!define UNINSTALL "Software\Microsoft\Windows\CurrentVersion\Uninstall\palpate"
!define APP_PATH "Software\Microsoft\Windows\CurrentVersion\App Paths\palpate.exe"

Section
  SetOutPath "$INSTDIR"
  File "${PROGRAM}\*"
  WriteUninstaller "$INSTDIR\uninstall.exe"
  CreateShortcut "$SMPROGRAMS\palpate.lnk" "$INSTDIR\palpate.exe" "window" "$INSTDIR\palpate.ico"
  WriteRegStr HKCU "Software\palpate" "Folder" "$INSTDIR"
  ; Win+R and "start palpate" find the program.
  WriteRegStr HKCU "${APP_PATH}" "" "$INSTDIR\palpate.exe"
  ; Other programs write .mcap files too: palpate is offered for them, and takes none away.
  WriteRegStr HKCU "Software\Classes\palpate.session" "" "palpate session"
  WriteRegStr HKCU "Software\Classes\palpate.session\DefaultIcon" "" "$INSTDIR\palpate.ico"
  WriteRegStr HKCU "Software\Classes\palpate.session\shell\open\command" "" '"$INSTDIR\palpate.exe" window "%1"'
  WriteRegStr HKCU "Software\Classes\.mcap\OpenWithProgids" "palpate.session" ""
  WriteRegStr HKCU "${UNINSTALL}" "DisplayName" "palpate"
  WriteRegStr HKCU "${UNINSTALL}" "DisplayVersion" "${VERSION}"
  WriteRegStr HKCU "${UNINSTALL}" "DisplayIcon" "$INSTDIR\palpate.ico"
  WriteRegStr HKCU "${UNINSTALL}" "UninstallString" '"$INSTDIR\uninstall.exe"'
  WriteRegStr HKCU "${UNINSTALL}" "QuietUninstallString" '"$INSTDIR\uninstall.exe" /S'
SectionEnd

; Sessions and settings are in the user's library and stay.
Section Uninstall
  Delete "$INSTDIR\palpate.exe"
  Delete "$INSTDIR\palpate.ico"
  Delete "$INSTDIR\*.txt"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR"
  Delete "$SMPROGRAMS\palpate.lnk"
  DeleteRegValue HKCU "Software\Classes\.mcap\OpenWithProgids" "palpate.session"
  DeleteRegKey HKCU "Software\Classes\palpate.session"
  DeleteRegKey HKCU "${APP_PATH}"
  DeleteRegKey HKCU "${UNINSTALL}"
  DeleteRegKey HKCU "Software\palpate"
SectionEnd
